// Which chunks or blocks a workgroup processes in turn: neighbours.

struct Stretch {
    first: u32,
    end: u32,
}

fn stretch(group: u32, groups: u32, count: u32) -> Stretch {
    let share = (count + groups - 1u) / groups;
    let first = min(group * share, count);
    return Stretch(first, min(first + share, count));
}
