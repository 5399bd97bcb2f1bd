//! Triangles of the colliders that are meshes or heightfields, for drawing.

use crate::pipelines::{buffer, group};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use pbmpm::{Shape, Units, World};

/// A corner of a triangle in its body's frame, in cells.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Corner {
    /// The fourth lane is the number of the body.
    position: [f32; 4],
    normal: [f32; 4],
}

/// All triangles of a world.
pub struct Meshes {
    pub corners: u32,
    pub group: wgpu::BindGroup,
}

impl Meshes {
    /// `None` where there are no triangles.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        world: &World,
        units: &Units,
    ) -> Option<Self> {
        let mut corners = Vec::new();
        for (body, collider) in world.colliders.iter().enumerate() {
            let (vertices, triangles) = match &collider.shape {
                Shape::Mesh(mesh) => (mesh.vertices(), mesh.triangles()),
                Shape::Heightfield(field) => (field.vertices(), field.triangles()),
                _ => continue,
            };
            append(&mut corners, body, vertices, triangles, units);
        }
        if corners.is_empty() {
            return None;
        }
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let stored = buffer(device, "triangles", size_of_val(&*corners), usage);
        queue.write_buffer(&stored, 0, bytemuck::cast_slice(&corners));
        let group = group(device, "triangles", layout, &[stored.as_entire_binding()]);
        Some(Meshes { corners: corners.len() as u32, group })
    }
}

/// Corners with the mean normal of the triangles around their vertex, except across edges.
fn append(corners: &mut Vec<Corner>, body: usize, vertices: &[DVec3], triangles: &[[u32; 3]], units: &Units) {
    let at = |i: u32| vertices[i as usize];
    let area = |&[a, b, c]: &[u32; 3]| (at(b) - at(a)).cross(at(c) - at(a));
    let mut around = vec![DVec3::ZERO; vertices.len()];
    triangles.iter().for_each(|t| t.iter().for_each(|i| around[*i as usize] += area(t)));
    for triangle in triangles {
        let flat = area(triangle).normalize_or_zero();
        for i in triangle {
            let round = around[*i as usize].normalize_or_zero();
            let normal = if round.dot(flat) > 0.8 { round } else { flat };
            let position = (at(*i) / units.cell_size).as_vec3().extend(body as f32);
            corners.push(Corner { position: position.to_array(), normal: normal.as_vec3().extend(0.0).to_array() });
        }
    }
}
