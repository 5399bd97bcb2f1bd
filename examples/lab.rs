use pbmpm::*; use glam::*;
fn main(){
    let mut a=std::env::args().skip(1);
    let which=a.next().unwrap(); let n:u32=a.next().unwrap().parse().unwrap();
    let mut w=World::new(DVec3::ZERO,DVec3::new(40.,50.,40.),1.0);
    w.materials.push(Material::liquid("water"));
    let mut s=Spawn::cuboid("water",DVec3::new(5.,10.,5.),DVec3::new(19.,24.,19.)); s.fill=Fill::Inclusive(UVec3::splat(25));
    w.spawns.push(s.clone()); s.position+=DVec3::new(16.,0.,16.); w.spawns.push(s);
    w.settings.dt=1./30.; w.settings.iterations=1;
    match which.as_str(){ "f32"=>go(CpuSolver::<f32>::new(&w).unwrap(),n), _=>go(CpuSolver::<f64>::new(&w).unwrap(),n)}
}
fn go<R:math::real::Real>(mut s:CpuSolver<R>,n:u32){
    for k in 0..n { s.step().unwrap(); if k%20==19 { let st=s.state().unwrap(); println!("{} t={:.3} com={:?} KE={:.4e} J={:?} b={:?}",k+1,s.time(),st.centre_of_mass_m,st.kinetic_j,st.volume_ratio,st.bounds_m);} }
    let t=std::time::Instant::now(); for _ in 0..100 {s.step().unwrap();} println!("ms/step {}",t.elapsed().as_secs_f64()*10.);
    for x in s.stage_times(){println!("{:15} {:.3} ms",x.stage,x.seconds*1e3);} println!("{:?} {:?}",s.report().unwrap(), s.memory());
}
