use pbmpm::*;
fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let mut w = scene::from_file(std::path::Path::new(&a[0])).unwrap();
    if let Some(i) = a.get(3) { w.settings.iterations = i.parse().unwrap(); }
    let n: u32 = a[2].parse().unwrap();
    let mut s: Box<dyn Simulate> = match a[1].as_str() {
        "cpu" => Box::new(CpuSolver::<f32>::new(&w).unwrap()),
        "cpu64" => Box::new(CpuSolver::<f64>::new(&w).unwrap()),
        x => { let mut h = Headless::new(&w, &AdapterChoice { name: x.into() }, &GpuOptions::default()).unwrap(); if n == 0 { h.measure_stages(); } Box::new(h) }
    };
    s.steps(n).unwrap();
    let t = std::time::Instant::now();
    s.steps(48).unwrap();
    println!("ms/step {}", t.elapsed().as_secs_f64() * 1e3 / 48.);
    for x in s.stage_times() { println!("{:15} {:.3} ms", x.stage, x.seconds * 1e3); }
    println!("{:?} {:?}", s.report().unwrap(), s.memory());
}
