use crate::backends::Tests;

pub fn add(_tests: &mut Tests) {}
