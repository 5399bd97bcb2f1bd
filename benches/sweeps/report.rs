//! The measurements and the tables printed of them, which the tests compare with docs/performance.md.

pub mod fit;
pub mod record;
pub mod table;
pub mod thesis;
