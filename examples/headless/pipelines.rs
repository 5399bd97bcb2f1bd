//! Pipelines of the picture, and short forms of wgpu's descriptors.

/// Colours in sRGB, so that samples blend in linear light.
pub const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Normals of particles, with the radius in the picture; 0 elsewhere.
pub const NORMAL: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// One pipeline for each kind of object in the picture.
pub struct Pipelines {
    pub background: wgpu::RenderPipeline,
    pub solid: wgpu::RenderPipeline,
    pub ball: wgpu::RenderPipeline,
    pub round: wgpu::RenderPipeline,
    pub mesh: wgpu::RenderPipeline,
    pub particle: wgpu::RenderPipeline,
    pub edge: wgpu::RenderPipeline,
    pub ghost: wgpu::RenderPipeline,
    pub glass: wgpu::RenderPipeline,
    pub mesh_glass: wgpu::RenderPipeline,
    pub resolve: wgpu::RenderPipeline,
}

impl Pipelines {
    pub fn new(
        device: &wgpu::Device,
        common: &wgpu::BindGroupLayout,
        particles: &wgpu::BindGroupLayout,
        triangles_of_meshes: &wgpu::BindGroupLayout,
        resolve: &wgpu::BindGroupLayout,
    ) -> Self {
        let module = |label: &str, source: &str| {
            let source = wgpu::ShaderSource::Wgsl(format!("{}{source}", include_str!("common.wgsl")).into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        };
        let frame = module("pbmpm headless frame", include_str!("frame.wgsl"));
        let colliders = module("pbmpm headless colliders", include_str!("colliders.wgsl"));
        let meshes = module("pbmpm headless meshes", include_str!("meshes.wgsl"));
        let particle = module("pbmpm headless particles", include_str!("particles.wgsl"));
        let alone = [Some(common)];
        let make = |name, module, entries, groups: &[_], mode, topology| {
            pipeline(device, name, module, entries, groups, mode, topology)
        };
        let (triangles, lines) = (wgpu::PrimitiveTopology::TriangleList, wgpu::PrimitiveTopology::LineList);
        let body = |name, entries, mode| make(name, &colliders, entries, &alone, mode, triangles);
        let with_meshes = [Some(common), Some(triangles_of_meshes)];
        let mesh = |name, entries, mode| make(name, &meshes, entries, &with_meshes, mode, triangles);
        let with_particles = [Some(common), Some(particles)];
        let with_scene = [Some(common), Some(resolve)];
        Pipelines {
            background: make("background", &frame, ("vs", "fs_background"), &alone, Mode::Behind, triangles),
            solid: body("solid faces", ("vs_solid", "fs_solid"), Mode::Opaque),
            ball: body("solid balls", ("vs_ball", "fs_ball"), Mode::Opaque),
            round: body("round bodies", ("vs_round", "fs_round"), Mode::Opaque),
            mesh: mesh("meshes", ("vs_solid", "fs_solid"), Mode::Opaque),
            particle: make("particles", &particle, ("vs", "fs"), &with_particles, Mode::Matter, triangles),
            edge: make("domain edges", &colliders, ("vs_edge", "fs_edge"), &alone, Mode::Glass, lines),
            ghost: body("see-through faces", ("vs_ghost", "fs_ghost"), Mode::Glass),
            glass: body("see-through walls", ("vs_round", "fs_glass"), Mode::Glass),
            mesh_glass: mesh("see-through meshes", ("vs_glass", "fs_glass"), Mode::Glass),
            resolve: make("resolve", &frame, ("vs", "fs_resolve"), &with_scene, Mode::Flat, triangles),
        }
    }
}

/// How a pipeline combines with what is already drawn.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Behind,
    Opaque,
    /// Opaque, and lit by the last pass.
    Matter,
    Glass,
    /// On the final picture.
    Flat,
}

fn pipeline(
    device: &wgpu::Device,
    name: &str,
    module: &wgpu::ShaderModule,
    (vertex, fragment): (&str, &str),
    groups: &[Option<&wgpu::BindGroupLayout>],
    mode: Mode,
    topology: wgpu::PrimitiveTopology,
) -> wgpu::RenderPipeline {
    let label = format!("pbmpm headless {name}");
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&label),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let depth = wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(matches!(mode, Mode::Opaque | Mode::Matter)),
        depth_compare: Some(if mode == Mode::Behind {
            wgpu::CompareFunction::Always
        } else {
            wgpu::CompareFunction::Greater
        }),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    let blend = (mode == Mode::Glass).then_some(wgpu::BlendState::ALPHA_BLENDING);
    let target = |format, blend, write_mask| Some(wgpu::ColorTargetState { format, blend, write_mask });
    let (all, none) = (wgpu::ColorWrites::ALL, wgpu::ColorWrites::empty());
    let normals = target(NORMAL, None, if mode == Mode::Matter { all } else { none });
    let targets = [target(PICTURE, blend, all), normals];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(&label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: (mode != Mode::Flat).then_some(depth),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: if mode == Mode::Flat { &targets[..1] } else { &targets },
        }),
        multiview_mask: None,
        cache: None,
    })
}

pub fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

pub fn cleared(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

pub fn uniform() -> wgpu::BindingType {
    let ty = wgpu::BufferBindingType::Uniform;
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub fn storage() -> wgpu::BindingType {
    let ty = wgpu::BufferBindingType::Storage { read_only: true };
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub fn sampled(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// Bindings 0, 1, … in order.
pub fn layout(
    device: &wgpu::Device,
    name: &str,
    bindings: &[(wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, &(visibility, ty))| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    let label = format!("pbmpm headless {name}");
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&label), entries: &entries })
}

/// Bindings 0, 1, … in order.
pub fn group(
    device: &wgpu::Device,
    name: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    let label = format!("pbmpm headless {name}");
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(&label), layout, entries: &entries })
}

pub fn buffer(device: &wgpu::Device, name: &str, size: usize, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let label = format!("pbmpm headless {name}");
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(&label),
        size: size as u64,
        usage,
        mapped_at_creation: false,
    })
}

pub fn texture(
    device: &wgpu::Device,
    name: &str,
    format: wgpu::TextureFormat,
    (width, height): (u32, u32),
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(&format!("pbmpm headless {name}")),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
