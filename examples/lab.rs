use pbmpm::*;
fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let w = scene::from_file(std::path::Path::new(&a[0])).unwrap();
    let mut w = w;
    if let Some(i) = a.get(3) {
        w.settings.iterations = i.parse().unwrap();
    }
    let n: u32 = a[2].parse().unwrap();
    let mut c = CpuSolver::<f32>::new(&w).unwrap();
    if a[1] == "cpu" {
        run(&mut c, n);
        return;
    }
    if a[1] == "cpu64" {
        run(&mut CpuSolver::<f64>::new(&w).unwrap(), n);
        return;
    }
    let mut g = Headless::new(&w, &AdapterChoice { name: a[1].clone() }, &GpuOptions::default()).unwrap();
    println!("{:?}", g.adapter());
    if std::env::var("TIME").is_ok() {
        run(&mut g, n);
        return;
    }
    let mut k = 0;
    while k < n {
        let s = 10.min(n - k);
        g.steps(s).unwrap();
        c.steps(s).unwrap();
        k += s;
        let (p, q) = (g.particles().unwrap(), c.particles().unwrap());
        let mut d: Vec<f64> = p.iter().zip(&q).map(|(a, b)| (a.position - b.position).length()).collect();
        d.sort_by(f64::total_cmp);
        println!(
            "{k} t={:.3} max={:.2e} p99={:.2e} med={:.2e} dKE={:.2e}",
            c.time(),
            d[d.len() - 1],
            d[d.len() * 99 / 100],
            d[d.len() / 2],
            (g.state().unwrap().kinetic_j - c.state().unwrap().kinetic_j) / c.state().unwrap().kinetic_j
        );
    }
    println!("{:?}\n{:?}\n{:?}", g.report().unwrap(), c.report().unwrap(), g.memory());
}
fn run(s: &mut dyn Simulate, n: u32) {
    for k in 0..n / 20 {
        s.steps(20).unwrap();
        if k % 5 == 4 {
            let st = s.state().unwrap();
            println!(
                "{} t={:.3} com={:.3?} KE={:.4e} L={:.3e} J={:.3?}",
                20 * k + 20,
                s.time(),
                st.centre_of_mass_m,
                st.kinetic_j,
                st.angular_momentum[1],
                st.volume_ratio
            );
        }
    }
    let t = std::time::Instant::now();
    s.steps(96).unwrap();
    println!("ms/step {}", t.elapsed().as_secs_f64() * 1e3 / 96.);
    for x in s.stage_times() {
        println!("{:15} {:.3} ms", x.stage, x.seconds * 1e3);
    }
    println!("{:?} {:?}", s.report().unwrap(), s.memory());
}
