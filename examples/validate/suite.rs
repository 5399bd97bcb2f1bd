//! The validation cases, shared by the example `validate`, the bench `work_precision` and the tests.

pub mod cases;
pub mod chart;
pub mod console;
pub mod file;
pub mod measure;
pub mod origin;
pub mod outcome;
pub mod run;
pub mod setup;
pub mod table;
