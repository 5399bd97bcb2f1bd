use pbmpm::*;
fn main(){ let a:Vec<String>=std::env::args().skip(1).collect();
 let w=scene::from_file(std::path::Path::new(&a[0])).unwrap();
 for d in lockstep::compare_step(&w,a[2].parse().unwrap(),&AdapterChoice{name:a[1].clone()}).unwrap(){ println!("{:14} {:36} {:8} {:6} {:.2e}",d.stage.name(),d.what,d.compared,d.unequal,d.largest); } }
