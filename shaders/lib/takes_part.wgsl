// Which chunks take part. Needs the binding chunks.
//
// As loops, since some devices also run code in branches that are not taken.

// The first chunk from `c` on whose particles are awake; `end` if there is none before that.
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

// The same with chunks that sleep beside awake ones, whose mass counts.
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
