//! What was measured, and what is printed of it; the tests compare it with docs/performance.md.

pub mod fit;
pub mod record;
pub mod table;
pub mod thesis;
