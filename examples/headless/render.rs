//! Pictures of the solver's buffers without a window: lit spheres for particles, solid colliders, PNG files.

use crate::camera::{View, fall_speed, hiding_faces, plane_patch};
use crate::meshes::Meshes;
use crate::pipelines::{
    DEPTH, NORMAL, PICTURE, Pipelines, buffer, cleared, group, layout, sampled, storage, texture, uniform, view,
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use pbmpm::{Collider, MAX_MATERIALS, ParticleBuffers, Pose, Shape, Units, Wall, World};
use std::path::Path;

const SOLID_COLOR: [f32; 3] = [0.44, 0.45, 0.47];
const MOVING_COLOR: [f32; 3] = [0.85, 0.24, 0.04];
const FLOOR_COLOR: [f32; 3] = [0.34, 0.36, 0.39];
/// The face towards the local +y axis, in the masks of [`Body::faces`].
const UPPER_FACE: u32 = 1 << 3;
/// Tags of the shapes that are ray-traced, the same numbers as in the shader.
const BOX: u32 = 1;
/// See [`BOX`].
const BALL: u32 = 2;
/// See [`BOX`].
const CAPSULE: u32 = 3;
/// See [`BOX`].
const CYLINDER: u32 = 4;

/// What the particles' colour shows.
#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum)]
pub enum ColorBy {
    /// The material's own colour.
    Material,
    /// Deep blue at rest to white at the speed of the longest fall.
    Speed,
    /// White at rest, red compressed, blue expanded; full colour at 10 %.
    Compression,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Frame {
    clip_from_cells: [[f32; 4]; 4],
    eye_near: [f32; 4],
    forward_color_by: [f32; 4],
    up_ramp: [f32; 4],
    sun_grid: [f32; 4],
    lo: [f32; 4],
    hi: [f32; 4],
    screen: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Body {
    axes: [[f32; 4]; 3],
    centre: [f32; 4],
    color: [f32; 4],
    faces: [u32; 4],
}

/// Draws pictures of one world, of one size.
pub struct Renderer {
    world: World,
    units: Units,
    size: (u32, u32),
    view: View,
    /// End of the speed ramp, m/s.
    fastest: f64,
    /// Per collider, the faces that are drawn see-through.
    hiding: Vec<u32>,
    pipelines: Pipelines,
    meshes: Option<Meshes>,
    particle_layout: wgpu::BindGroupLayout,
    frame: wgpu::Buffer,
    bodies: wgpu::Buffer,
    common: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
    scene: wgpu::Texture,
    normals: wgpu::Texture,
    depth: wgpu::Texture,
    picture: wgpu::Texture,
    readback: wgpu::Buffer,
    bytes_per_row: u32,
}

impl Renderer {
    /// Pipelines and targets for pictures of `world`, whose solver works in `units`. Fails for a `size` that the device
    /// cannot hold.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        world: &World,
        units: &Units,
        size: (u32, u32),
    ) -> Result<Self, String> {
        let limit = device.limits().max_texture_dimension_2d;
        if size.0.min(size.1) == 0 || size.0.max(size.1) > limit {
            return Err(format!("a picture of {} x {}: each side must be 1 to {limit} pixels", size.0, size.1));
        }
        // Two by two samples per pixel if the device has textures that large: spheres have no edges for MSAA to find.
        let samples = if size.0.max(size.1) * 2 <= limit { 2 } else { 1 };
        let (width, height) = (size.0 * samples, size.1 * samples);
        use wgpu::TextureUsages as Use;
        let layer = |name, format| {
            texture(device, name, format, (width, height), Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING)
        };
        let [scene, normals, depth] = [layer("scene", PICTURE), layer("normals", NORMAL), layer("depth", DEPTH)];
        let picture = texture(device, "picture", PICTURE, size, Use::RENDER_ATTACHMENT | Use::COPY_SRC);
        let bytes_per_row = (size.0 * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);

        use wgpu::BufferUsages as Usage;
        let frame = buffer(device, "frame", size_of::<Frame>(), Usage::UNIFORM | Usage::COPY_DST);
        let materials = buffer(device, "materials", MAX_MATERIALS * 16, Usage::UNIFORM | Usage::COPY_DST);
        let bodies_size = (world.colliders.len() + 1) * size_of::<Body>();
        let bodies = buffer(device, "bodies", bodies_size, Usage::STORAGE | Usage::COPY_DST);
        let readback_size = bytes_per_row as usize * size.1 as usize;
        let readback = buffer(device, "readback", readback_size, Usage::COPY_DST | Usage::MAP_READ);
        let mut palette = [[1.0f32; 4]; MAX_MATERIALS];
        for (entry, m) in palette.iter_mut().zip(&world.materials) {
            *entry = [m.color[0], m.color[1], m.color[2], (m.rest_density / units.density) as f32];
        }
        queue.write_buffer(&materials, 0, bytemuck::bytes_of(&palette));

        use wgpu::ShaderStages as Stage;
        let both = Stage::VERTEX_FRAGMENT;
        let common_layout = layout(device, "common", &[(both, uniform()), (both, uniform()), (both, storage())]);
        let particle_layout = layout(device, "particles", &[(Stage::VERTEX, storage()); 3]);
        let mesh_layout = layout(device, "triangles", &[(Stage::VERTEX, storage())]);
        let resolve_layout = layout(
            device,
            "resolve",
            &[(Stage::FRAGMENT, sampled(wgpu::TextureSampleType::Float { filterable: false })); 3],
        );
        let common = [frame.as_entire_binding(), materials.as_entire_binding(), bodies.as_entire_binding()];
        let common = group(device, "common", &common_layout, &common);
        let views = [&scene, &normals, &depth].map(view);
        let resolve = views.each_ref().map(wgpu::BindingResource::TextureView);
        let resolve = group(device, "resolve", &resolve_layout, &resolve);
        let pipelines = Pipelines::new(device, &common_layout, &particle_layout, &mesh_layout, &resolve_layout);
        Ok(Renderer {
            world: world.clone(),
            units: *units,
            size,
            view: View::new(world, units, size.0 as f32 / size.1 as f32),
            fastest: fall_speed(world),
            hiding: world.colliders.iter().map(|c| if moves(c) { 0 } else { hiding_faces(world, c) }).collect(),
            pipelines,
            meshes: Meshes::new(device, queue, &mesh_layout, world, units),
            particle_layout,
            frame,
            bodies,
            common,
            resolve,
            scene,
            normals,
            depth,
            picture,
            readback,
            bytes_per_row,
        })
    }

    /// Draws and reads back a picture: rows from the top, 4 bytes of sRGB and alpha per pixel. `poses[i]` is that of
    /// `world.colliders[i]`, `dt` the last step's length in s.
    pub fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        particles: &ParticleBuffers<'_>,
        poses: &[Pose],
        dt: f64,
        color: ColorBy,
    ) -> Result<Vec<u8>, String> {
        if poses.len() != self.world.colliders.len() {
            return Err(format!("{} poses for {} colliders", poses.len(), self.world.colliders.len()));
        }
        let bodies: Vec<Body> = poses.iter().enumerate().map(|(i, p)| self.body(i, p)).chain([self.floor()]).collect();
        queue.write_buffer(&self.bodies, 0, bytemuck::cast_slice(&bodies));
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&self.frame_data(dt, color)));
        let mut encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("pbmpm headless picture") });
        self.encode_scene(device, &mut encoder, particles, bodies.len() as u32);
        self.encode_resolve(&mut encoder);
        queue.submit([encoder.finish()]);
        self.read(device)
    }

    fn frame_data(&self, dt: f64, color: ColorBy) -> Frame {
        let with = |v: Vec3, w: f32| v.extend(w).to_array();
        let domain = &self.world.domain;
        let corner = |p| self.units.position_in(p).as_vec3();
        // About a dozen squares of 1, 2 or 5 times a power of ten metres along the domain's longest side.
        let wanted = (domain.max - domain.min).max_element() / 12.0;
        let decade = 10f64.powf(wanted.log10().floor());
        let grid = decade * [5.0, 2.0, 1.0].into_iter().find(|k| k * decade <= wanted).unwrap_or(1.0);
        let ramp = self.units.velocity_in(DVec3::X * self.fastest, dt).x.max(1e-12);
        let lines = self.scene.height() as f32;
        let screen =
            [(self.scene.height() / self.size.1) as f32, lines / 720.0, 2.0 * self.view.half_height / lines, 0.0];
        Frame {
            clip_from_cells: self.view.clip_from_cells.to_cols_array_2d(),
            eye_near: with(self.view.eye, self.view.near),
            forward_color_by: with(self.view.forward, color as u8 as f32),
            up_ramp: with(self.view.up, ramp as f32),
            sun_grid: with(self.view.sun, self.units.length_in(grid) as f32),
            lo: with(corner(domain.min), 0.0),
            hi: with(corner(domain.max), 0.0),
            screen,
        }
    }

    fn body(&self, index: usize, pose: &Pose) -> Body {
        let collider = &self.world.colliders[index];
        let moves = moves(collider);
        let color = if moves { MOVING_COLOR } else { SOLID_COLOR };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| pose.rotation * axis);
        let hiding = self.hiding[index];
        match collider.shape {
            Shape::Box { .. } if collider.inverted => self.round(pose.position, axes, collider, BOX, color),
            Shape::Sphere { .. } if collider.inverted => self.round(pose.position, axes, collider, BALL, color),
            Shape::Box { half_size } => self.block(pose.position, axes, half_size, 0b11_1111, hiding, (color, 0.0)),
            Shape::Sphere { radius } => {
                let mut body = self.block(pose.position, axes, DVec3::ZERO, 0, 0, (color, 0.0));
                body.centre[3] = self.units.length_in(radius) as f32;
                body
            }
            Shape::HalfSpace => {
                let (centre, half) = plane_patch(&self.world, pose.position, axes[1]);
                let half = DVec3::new(half, 0.0, half);
                self.block(centre, axes, half, UPPER_FACE, hiding, (if moves { color } else { FLOOR_COLOR }, 1.0))
            }
            Shape::Capsule { .. } => self.round(pose.position, axes, collider, CAPSULE, color),
            Shape::Cylinder { .. } => self.round(pose.position, axes, collider, CYLINDER, color),
            // These are not ray-traced; their triangles are drawn separately.
            Shape::Mesh(_) | Shape::Heightfield(_) => self.round(pose.position, axes, collider, 0, color),
            // A shape that this program does not know is left out.
            _ => self.block(pose.position, axes, DVec3::ZERO, 0, 0, (color, 0.0)),
        }
    }

    /// A body that is ray-traced.
    fn round(&self, centre: DVec3, axes: [DVec3; 3], collider: &Collider, shape: u32, color: [f32; 3]) -> Body {
        let half = collider.shape.half_extent().unwrap_or(DVec3::ZERO);
        let mut body = self.block(centre, axes, half, 0, 0, (color, 0.0));
        body.faces[2] = shape;
        body.faces[3] = u32::from(collider.inverted);
        body
    }

    /// The domain's floor, where it holds matter; a little below, so that colliders that end there cover it.
    fn floor(&self) -> Body {
        let (lo, hi) = (self.world.domain.min, self.world.domain.max);
        let half = (hi - lo) * 0.5 * DVec3::new(1.0, 0.0, 1.0);
        let centre = lo + half - DVec3::Y * 0.05 * self.units.cell_size;
        let faces = if self.world.domain.walls.y_min == Wall::Open { 0 } else { UPPER_FACE };
        self.block(centre, [DVec3::X, DVec3::Y, DVec3::Z], half, faces, 0, (FLOOR_COLOR, 1.0))
    }

    /// The `faces` are drawn, those that are also in `ghosts` see-through; `color` contains the share of the grid
    /// lines.
    fn block(
        &self,
        centre: DVec3,
        axes: [DVec3; 3],
        half: DVec3,
        faces: u32,
        ghosts: u32,
        (color, grid): ([f32; 3], f32),
    ) -> Body {
        let axis = |k: usize| axes[k].as_vec3().extend(self.units.length_in(half[k]) as f32).to_array();
        Body {
            axes: [axis(0), axis(1), axis(2)],
            centre: self.units.position_in(centre).as_vec3().extend(0.0).to_array(),
            color: [color[0], color[1], color[2], grid],
            faces: [faces & !ghosts, faces & ghosts, 0, 0],
        }
    }

    fn encode_scene(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        p: &ParticleBuffers<'_>,
        bodies: u32,
    ) {
        let [scene, normals, depth] = [&self.scene, &self.normals, &self.depth].map(view);
        let farthest = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("pbmpm headless scene"),
            color_attachments: &[Some(cleared(&scene)), Some(cleared(&normals))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(farthest),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.common, &[]);
        pass.set_pipeline(&self.pipelines.background);
        pass.draw(0..3, 0..1);
        pass.set_pipeline(&self.pipelines.solid);
        pass.draw(0..36, 0..bodies);
        pass.set_pipeline(&self.pipelines.ball);
        pass.draw(0..6, 0..bodies);
        pass.set_pipeline(&self.pipelines.round);
        pass.draw(0..36, 0..bodies);
        if let Some(meshes) = &self.meshes {
            pass.set_pipeline(&self.pipelines.mesh);
            pass.set_bind_group(1, &meshes.group, &[]);
            pass.draw(0..meshes.corners, 0..1);
        }
        if p.count > 0 {
            let buffers = [p.position, p.displacement, p.gradient].map(|b| b.as_entire_binding());
            let buffers = group(device, "particles", &self.particle_layout, &buffers);
            pass.set_pipeline(&self.pipelines.particle);
            pass.set_bind_group(1, &buffers, &[]);
            pass.draw(0..6, 0..p.count);
        }
        pass.set_pipeline(&self.pipelines.edge);
        pass.draw(0..24, 0..1);
        pass.set_pipeline(&self.pipelines.ghost);
        pass.draw(0..36, 0..bodies);
        pass.set_pipeline(&self.pipelines.glass);
        pass.draw(0..36, 0..bodies);
        if let Some(meshes) = &self.meshes {
            pass.set_pipeline(&self.pipelines.mesh_glass);
            pass.set_bind_group(1, &meshes.group, &[]);
            pass.draw(0..meshes.corners, 0..1);
        }
    }

    fn encode_resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let picture = view(&self.picture);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("pbmpm headless resolve"),
            color_attachments: &[Some(cleared(&picture))],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.common, &[]);
        pass.set_bind_group(1, &self.resolve, &[]);
        pass.set_pipeline(&self.pipelines.resolve);
        pass.draw(0..3, 0..1);
        drop(pass);
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(self.bytes_per_row), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &self.readback, layout };
        encoder.copy_texture_to_buffer(self.picture.as_image_copy(), target, self.picture.size());
    }

    fn read(&self, device: &wgpu::Device) -> Result<Vec<u8>, String> {
        let (sender, mapped) = std::sync::mpsc::channel();
        // The receiver is dropped only if the poll below failed, which is reported.
        self.readback.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| format!("waiting for the picture: {e}"))?;
        let result = mapped.recv().map_err(|e| format!("waiting for the picture: {e}"))?;
        result.map_err(|e| format!("mapping the picture: {e}"))?;
        let row = self.size.0 as usize * 4;
        let pixels = self
            .readback
            .get_mapped_range(..)
            .map(|bytes| bytes.chunks_exact(self.bytes_per_row as usize).flat_map(|r| r[..row].to_vec()).collect())
            .map_err(|e| format!("mapping the picture: {e}"));
        self.readback.unmap();
        pixels
    }
}

fn moves(collider: &Collider) -> bool {
    let scripted = collider.motion.is_some();
    scripted || collider.linear_velocity != DVec3::ZERO || collider.angular_velocity != DVec3::ZERO
}

/// Writes `rgba`, as [`Renderer::draw`] returns it, to a PNG file.
pub fn write_png(path: &Path, size: (u32, u32), rgba: &[u8]) -> std::io::Result<()> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, size.0, size.1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()?;
    Ok(())
}
