//! Assembles a stage's WGSL: `#import name` takes in a file of `shaders/lib` once, `#if NAME` … `#else` … `#endif` keeps
//! its lines only in variants that have it; it does not nest. What a scene does not need is not in the text.

use super::layout::shared_constants;
use crate::plan::Stage;
use crate::stages::kernel;

/// What a world's shaders are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// There are walls or bodies.
    pub colliders: bool,
    /// How many materials there are.
    pub materials: usize,
}

const LIBRARY: [(&str, &str); 9] = [
    ("layout", include_str!("../../shaders/lib/layout.wgsl")),
    ("linear", include_str!("../../shaders/lib/linear.wgsl")),
    ("kernel", include_str!("../../shaders/lib/kernel.wgsl")),
    ("bins", include_str!("../../shaders/lib/bins.wgsl")),
    ("table", include_str!("../../shaders/lib/table.wgsl")),
    ("chunk", include_str!("../../shaders/lib/chunk.wgsl")),
    ("halt", include_str!("../../shaders/lib/halt.wgsl")),
    ("sdf", include_str!("../../shaders/lib/sdf.wgsl")),
    ("contact", include_str!("../../shaders/lib/contact.wgsl")),
];

/// The whole text of a stage's shader. Imports come first, in the order in which they are named.
pub fn source(stage: Stage, variant: Variant) -> String {
    let mut text = shared_constants(variant.materials);
    let mut body = String::new();
    let mut keep = true;
    for line in kernel(stage).source.lines() {
        if let Some(condition) = line.strip_prefix("#if ") {
            keep = match condition.trim() {
                "COLLIDERS" => variant.colliders,
                other => unreachable!("no variant is called {other}"),
            };
        } else if line.trim() == "#else" {
            keep = !keep;
        } else if line.trim() == "#endif" {
            keep = true;
        } else if let Some(name) = line.strip_prefix("#import ") {
            if keep {
                let found = LIBRARY.iter().find(|(n, _)| *n == name.trim());
                text.push_str(found.map_or_else(|| unreachable!("no library file is called {name}"), |(_, text)| text));
            }
        } else if keep {
            body.push_str(line);
            body.push('\n');
        }
    }
    text + &body
}
