// Blocks whose nodes have no mass, because every block that could bring some sleeps. Twin: `Block` in
// src/stages/bin_sleep.rs. Needs the binding blocks, where matter may sleep.
//
// As loops, since some devices also run code in branches that are not taken.

#if SLEEP
fn is_idle(block: u32) -> bool {
    return blocks[block].tiles == 0u;
}
#endif

// The first other block from `b` on; `end` if there is none before that.
fn busy_from(b: u32, end: u32) -> u32 {
    return busy_among(b, end, 1u);
}

// The first of b, b + step, b + 2 step …; `end` or more if there is none before that.
fn busy_among(b: u32, end: u32, step: u32) -> u32 {
#if SLEEP
    var next = b;
    while next < end && is_idle(next) {
        next += step;
    }
    return next;
#else
    return b;
#endif
}
