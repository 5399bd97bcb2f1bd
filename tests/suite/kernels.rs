//! Runs a piece of WGSL by itself on a device.

use crate::backends::Backend;
use bytemuck::{NoUninit, Pod, cast_slice};
use std::time::Duration;

/// The output of the kernel in `text` at binding 1, `count` values of `Out`, for the array `input` at binding 0. The
/// text has one entry point, with workgroups of 64 invocations and one invocation per result.
pub fn run_kernel<Out: Pod>(backend: Backend, text: &str, input: &[impl NoUninit], count: usize) -> Vec<Out> {
    let adapter = backend.adapter();
    let (device, queue) = pbmpm::open_device(&adapter, wgpu::Limits::downlevel_defaults()).expect("a device");
    let buffer = |size: usize, usage| {
        let size = size as u64;
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let storage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let inputs = buffer(size_of_val(input), storage);
    queue.write_buffer(&inputs, 0, cast_slice(input));
    let size = count * size_of::<Out>();
    let results = buffer(size, storage);
    let staging = buffer(size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);

    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let entries = [(0, &inputs), (1, &results)]
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() });
    let layout = &pipeline.get_bind_group_layout(0);
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&results, 0, &staging, 0, size as u64);
    encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    let index = queue.submit([encoder.finish()]);
    let wait = wgpu::PollType::Wait { submission_index: Some(index), timeout: Some(Duration::from_secs(60)) };
    device.poll(wait).expect("the device answers");
    bytemuck::pod_collect_to_vec(&staging.get_mapped_range(..).expect("mapped"))
}
