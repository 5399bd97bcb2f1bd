//! Structures and bindings agree between Rust and the shaders, as the shader compiler sees them.

use crate::backends::Tests;
use crate::shaders_valid::{module, variants};
use naga::{AddressSpace, StorageAccess, TypeInner};
use pbmpm::shaders;
use std::collections::{BTreeMap, HashMap};

pub fn add(tests: &mut Tests) {
    tests.once("layouts_match", "structures", structures);
    tests.once("layouts_match", "bindings", bindings);
    tests.once("layouts_match", "element_strides_of_buffers", element_strides_of_buffers);
}

/// Size and field offsets of every structure in a module, by name.
fn shader_structures(module: &naga::Module) -> HashMap<String, (u32, Vec<(String, u32)>)> {
    let structures = module.types.iter().filter_map(|(_, ty)| match &ty.inner {
        TypeInner::Struct { members, span } => {
            let members = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
            Some((ty.name.clone().unwrap_or_default(), (*span, members)))
        }
        _ => None,
    });
    structures.collect()
}

fn structures() {
    let mut compared = BTreeMap::new();
    for (stage, variant) in variants() {
        let found = shader_structures(&module(stage, variant));
        for (name, size, fields) in shaders::structures() {
            let Some((span, members)) = found.get(name) else { continue };
            let mut rust: Vec<_> = fields.iter().map(|(field, offset)| (field.to_string(), *offset as u32)).collect();
            if name == "Counters" && variant.of_stage(stage).loads {
                // The loads, whose number depends on the world, follow the counters; the span includes their first
                // word.
                rust.push(("loads".to_owned(), size as u32));
                assert_eq!(*span as usize, size + 4, "{name} in {stage:?} {variant:?}");
            } else if name == "Place" && !variant.features.sleep {
                // The time for which a particle has been at rest is not stored.
                rust.pop();
                assert_eq!(*span as usize, size - 4, "{name} in {stage:?} {variant:?}");
            } else if name == "Chunk" && !variant.features.shares_pressure {
                // There is no shared pressure of the block.
                rust.truncate(rust.len() - 2);
                assert_eq!(*span as usize, size - 8, "{name} in {stage:?} {variant:?}");
            } else {
                assert_eq!(*span as usize, size, "size of {name} in {stage:?} {variant:?}");
            }
            assert_eq!(*members, rust, "{name} in {stage:?} {variant:?}");
            *compared.entry(name).or_insert(0) += 1;
        }
        if let (Some(entry), Some(view)) = (found.get("TableEntry"), found.get("TableEntryView")) {
            assert_eq!(entry, view, "the two faces of a table entry");
        }
        if let (Some(block), Some(shared)) = (found.get("Block"), found.get("SharedBlock")) {
            assert_eq!(block, shared, "the two faces of a block");
        }
        for (face, whole) in [("SolveView", "Solve"), ("BlockSumsView", "BlockSums")] {
            let Some(view) = found.get(face) else { continue };
            let (_, size, fields) = shaders::structures().into_iter().find(|s| s.0 == whole).expect(whole);
            let rust: Vec<_> = fields.iter().map(|(field, offset)| (field.to_string(), *offset as u32)).collect();
            assert_eq!(*view, (size as u32, rust), "{face}, the other face of {whole}");
        }
    }
    for (name, _, _) in shaders::structures() {
        assert!(compared.get(name).is_some_and(|n| *n > 0), "{name} is in no shader");
    }
}

fn bindings() {
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        let mut declared: Vec<(u32, String, bool, bool)> = Vec::new();
        for (_, variable) in module.global_variables.iter() {
            let Some(place) = &variable.binding else { continue };
            assert_eq!(place.group, 0, "{stage:?}");
            let (write, uniform) = match variable.space {
                AddressSpace::Uniform => (false, true),
                AddressSpace::Storage { access } => (access.contains(StorageAccess::STORE), false),
                AddressSpace::Handle => (false, false),
                other => panic!("{stage:?}: {other:?}"),
            };
            declared.push((place.binding, variable.name.clone().unwrap_or_default(), write, uniform));
        }
        declared.sort();
        let mut made: Vec<_> =
            shaders::bindings(stage, variant).into_iter().map(|(n, name, w, u)| (n, name.to_owned(), w, u)).collect();
        made.sort();
        assert_eq!(declared, made, "{stage:?} {variant:?}");
    }
}

/// Buffers hold the same elements in every stage that binds them, whatever type name the stage uses.
fn element_strides_of_buffers() {
    let mut strides: BTreeMap<String, BTreeMap<u32, Vec<String>>> = BTreeMap::new();
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        for (_, variable) in module.global_variables.iter().filter(|(_, v)| v.binding.is_some()) {
            if let TypeInner::Array { stride, .. } = module.types[variable.ty].inner {
                let name = variable.name.clone().unwrap_or_default();
                strides.entry(name).or_default().entry(stride).or_default().push(format!("{stage:?}"));
            }
        }
    }
    let structure = |name: &str| shaders::structures().into_iter().find(|s| s.0 == name).expect(name).1 as u32;
    let expected = [
        ("materials", structure("Material")),
        ("colliders", structure("Collider")),
        ("table", structure("TableEntry")),
        ("blocks", structure("Block")),
        ("position", 16),
        ("displacement", 16),
        ("gradient", 48),
        ("held", structure("Held")),
        ("field", 16),
    ];
    for (name, stride) in expected {
        let found = strides.get(name).unwrap_or_else(|| panic!("no shader binds {name}"));
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), [stride], "{name}: {found:?}");
    }
    // Buffers that are summed number by number and read node by node, and elements that are larger where there are
    // solids, where matter may sleep or where pressures are shared.
    let (rests, shares) = (structure("Place"), structure("Chunk"));
    let two = [
        ("grid", [4, 16]),
        ("force", [4, 16]),
        ("couplings", [4, 16]),
        ("search", [structure("Search"), structure("StressSearch")]),
        ("bin", [rests - 4, rests]),
        ("chunks", [shares - 8, shares]),
    ];
    for (name, found) in strides.iter().filter(|(name, _)| two.iter().all(|(other, _)| other != name)) {
        assert_eq!(found.len(), 1, "{name}: {found:?}");
    }
    for (name, strides_of) in two {
        assert_eq!(strides[name].keys().copied().collect::<Vec<_>>(), strides_of, "{name}");
    }
}
