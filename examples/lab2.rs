use pbmpm::*;
fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let w = scene::from_file(std::path::Path::new(&a[0])).unwrap();
    let mut c = CpuSolver::<f32>::new(&w).unwrap();
    let mut d = Headless::new(&w, &AdapterChoice { name: a[1].clone() }, &GpuOptions::default()).unwrap();
    for k in 0..12 {
        let (p, q) = (c.particles().unwrap(), d.particles().unwrap());
        let n = |f: &dyn Fn(&Particle, &Particle) -> bool| p.iter().zip(&q).filter(|(a, b)| f(a, b)).count();
        let mx = |f: &dyn Fn(&Particle, &Particle) -> f64| p.iter().zip(&q).map(|(a, b)| f(a, b)).fold(0., f64::max);
        println!(
            "{k} x:{} v:{} D:{} J:{} | {:.1e} {:.1e} {:.1e} {:.1e}",
            n(&|a, b| a.position != b.position),
            n(&|a, b| a.velocity != b.velocity),
            n(&|a, b| a.velocity_gradient != b.velocity_gradient),
            n(&|a, b| a.volume_ratio != b.volume_ratio),
            mx(&|a, b| (a.position - b.position).length()),
            mx(&|a, b| (a.velocity - b.velocity).length()),
            mx(&|a, b| {
                let m = a.velocity_gradient - b.velocity_gradient;
                m.x_axis.length() + m.y_axis.length() + m.z_axis.length()
            }),
            mx(&|a, b| (a.volume_ratio - b.volume_ratio).abs())
        );
        c.steps(1).unwrap();
        d.steps(1).unwrap();
    }
}
