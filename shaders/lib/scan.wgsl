// Sums over the invocations of a workgroup.

var<workgroup> scanned: array<u32, GROUP>;

// Of the invocations before this one, and of all.
struct Scan {
    before: u32,
    total: u32,
}

// The whole workgroup has to ask.
fn sums(lane: u32, value: u32) -> Scan {
    // Those of the call before have been read.
    workgroupBarrier();
    scanned[lane] = value;
    workgroupBarrier();
    var result = Scan(0u, 0u);
    for (var i = 0u; i < GROUP; i++) {
        if i == lane {
            result.before = result.total;
        }
        result.total += scanned[i];
    }
    return result;
}
