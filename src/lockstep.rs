//! CPU and GPU in lockstep.
