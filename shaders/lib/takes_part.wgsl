// Which chunks take part. Needs the binding chunks.
//
// As loops, since some devices go through what a condition leaves out.

// The first chunk from `c` on whose particles are awake; `end` where there is none before.
fn awake_from(c: u32, end: u32) -> u32 {
#if SLEEP
    var next = c;
    while next < end && chunks[next].sleep != AWAKE {
        next++;
    }
    return next;
#else
    return c;
#endif
}

// The same with those that sleep beside others, whose mass counts.
fn with_mass_from(c: u32, end: u32) -> u32 {
#if SLEEP
    var next = c;
    while next < end && chunks[next].sleep == DEEP {
        next++;
    }
    return next;
#else
    return c;
#endif
}
