//! The solver as a guest in a program that draws: one device, one encoder per frame, particles that never leave the
//! device. `cargo run --release --example embed` writes the last frame to `out/embed.png` instead of showing a window.

use glam::{DVec3, Vec3};
use pbmpm::{Collider, FixedStep, GpuOptions, GpuSolver, Material, Quality, Shape, Spawn, World};
use std::collections::VecDeque;

type Failure = Box<dyn std::error::Error>;

const SIZE: wgpu::Extent3d = wgpu::Extent3d { width: 1280, height: 720, depth_or_array_layers: 1 };
const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

fn main() -> Result<(), Failure> {
    if let Some(argument) = std::env::args().nth(1) {
        return Err(format!("{argument}: this example takes no arguments").into());
    }
    // The world: a column of water that is about to fall over a ball.
    let mut world = World::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 0.5), 0.0625);
    world.materials.push(Material::liquid("water"));
    world.spawns.push(Spawn::cuboid("water", DVec3::ZERO, DVec3::new(0.5, 0.75, 0.5)));
    world.colliders.push(Collider::new(Shape::Sphere { radius: 0.18 }, DVec3::new(1.2, 0.1, 0.25)));
    world.settings = Quality::Realtime.settings(&world);
    // Steps of one length, between which frames are blended. With the quality's Courant number,
    // `GpuSolver::plan_frame` divides each frame by its fastest matter instead, and `blend` is 1.
    world.settings.courant = 0.0;

    // The host's own device: WebGPU's defaults, plus whatever the solver needs beyond them.
    let options = GpuOptions::default();
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let required_limits = GpuSolver::required_limits(&world, &options)?;
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;

    let mut solver = GpuSolver::new(&device, &queue, &world, &options)?;
    // Up to twice the steps of a frame at 60 Hz, then the simulation falls behind instead of the program.
    let most = (2.0 / 60.0 / world.settings.dt).ceil() as u32;
    let mut driver = FixedStep::new(world.settings.dt, most)?;
    let view = Picture::new(&device);

    let mut in_flight = VecDeque::new();
    for _frame in 0..120 {
        // A game measures this; frames of 1/60 s and steps of 1/170 s make two or three steps a frame.
        let now = driver.advance(1.0 / 60.0);

        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for _ in 0..now.steps {
            solver.encode_step(&mut encoder)?;
        }
        view.draw(&queue, &mut encoder, &solver, now.blend);
        solver.encode_report(&mut encoder);
        in_flight.push_back(queue.submit([encoder.finish()]));

        // Polling collects reports. A window's swap chain keeps a program from running ahead of its device, so that
        // `wgpu::PollType::Poll` is enough there; here, two frames may be in flight.
        if in_flight.len() > 2 {
            device.poll(wgpu::PollType::Wait { submission_index: in_flight.pop_front(), timeout: None })?;
        }
        // The newest report, of a step some frames ago; `solver.report()` keeps it.
        solver.poll_report()?;
    }

    device.poll(wgpu::PollType::wait_indefinitely())?;
    solver.poll_report()?;
    println!("{:#?}", solver.report());
    view.save(&device, &queue, "out/embed.png")
}

/// The host's picture.
struct Picture {
    color: wgpu::Texture,
    depth: wgpu::Texture,
    uniforms: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
}

impl Picture {
    fn new(device: &wgpu::Device) -> Self {
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: SIZE,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 96,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let module = device.create_shader_module(wgpu::include_wgsl!("embed.wgsl"));
        // One `vec4f` per particle from each of two buffers of the solver.
        let (position, displacement) =
            (wgpu::vertex_attr_array![0 => Float32x4], wgpu::vertex_attr_array![1 => Float32x4]);
        let per_particle = |attributes| {
            Some(wgpu::VertexBufferLayout { array_stride: 16, step_mode: wgpu::VertexStepMode::Instance, attributes })
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("particles"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs"),
                compilation_options: Default::default(),
                buffers: &[per_particle(&position), per_particle(&displacement)],
            },
            primitive: wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::TriangleStrip, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs"),
                compilation_options: Default::default(),
                targets: &[Some(COLOR.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() }],
        });
        let color = texture(COLOR, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH, wgpu::TextureUsages::empty());
        Picture { color, depth, uniforms, bindings, pipeline }
    }

    /// Draws the particles from the solver's buffers.
    fn draw(&self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, solver: &GpuSolver, blend: f64) {
        // The solver's buffers hold cells; so the camera is placed in cells too.
        let cells = |x, y, z| solver.units().position_in(DVec3::new(x, y, z)).as_vec3();
        let (eye, target) = (cells(1.4, 1.1, 2.2), cells(1.0, 0.35, 0.25));
        let forward = (target - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let aspect = SIZE.width as f32 / SIZE.height as f32;
        let clip = glam::camera::rh::proj::directx::perspective_infinite_reverse(0.8, aspect, 0.5);
        let clip = clip * glam::camera::rh::view::look_to_mat4(eye, forward, up);
        let mut uniforms = clip.to_cols_array().to_vec();
        uniforms.extend(right.extend(0.3).to_array());
        uniforms.extend(up.extend(blend as f32).to_array());
        queue.write_buffer(&self.uniforms, 0, bytemuck::cast_slice(&uniforms));

        let clear = wgpu::LoadOp::Clear(wgpu::Color { r: 0.05, g: 0.06, b: 0.08, a: 1.0 });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: clear, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let particles = solver.particle_buffers();
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_vertex_buffer(0, particles.position.slice(..));
        pass.set_vertex_buffer(1, particles.displacement.slice(..));
        pass.draw(0..4, 0..particles.count);
    }

    /// Writes the picture to a PNG file; a host with a window presents it instead.
    fn save(&self, device: &wgpu::Device, queue: &wgpu::Queue, path: &str) -> Result<(), Failure> {
        let bytes_per_row = SIZE.width * 4; // a multiple of 256, as the copy requires
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(bytes_per_row * SIZE.height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: None };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(self.color.as_image_copy(), target, SIZE);
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., |_| {});
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
        let pixels = buffer.get_mapped_range(..)?;
        std::fs::create_dir_all("out")?;
        let mut png = png::Encoder::new(std::fs::File::create(path)?, SIZE.width, SIZE.height);
        png.set_color(png::ColorType::Rgba);
        png.write_header()?.write_image_data(&pixels)?;
        println!("{path}");
        Ok(())
    }
}
