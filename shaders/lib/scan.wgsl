// Sums over the invocations of a workgroup.

var<workgroup> scanned: array<u32, GROUP>;

// The sum over the invocations before this one, and over all.
struct Scan {
    before: u32,
    total: u32,
}

// The whole workgroup must call this.
fn sums(lane: u32, value: u32) -> Scan {
    // All have read the numbers of the call before.
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
