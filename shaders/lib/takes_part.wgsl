// Which chunks take part. Needs the binding chunks.
//
// As loops, since some devices go through what a condition leaves out.

// The first chunk from `c` on, in strides of so many, whose particles are awake; not below `count` where there is none.
fn awake_from(c: u32, stride: u32, count: u32) -> u32 {
#if SLEEP
    var next = c;
    while next < count && chunks[next].sleep != AWAKE {
        next += stride;
    }
    return next;
#else
    return c;
#endif
}

// The same with those that sleep beside others, whose mass counts.
fn with_mass_from(c: u32, stride: u32, count: u32) -> u32 {
#if SLEEP
    var next = c;
    while next < count && chunks[next].sleep == DEEP {
        next += stride;
    }
    return next;
#else
    return c;
#endif
}
