// Where the invocations of a workgroup wait for each other, if they share a tile.

#if TILES
fn meet() {
    workgroupBarrier();
}
#else
fn meet() {}
#endif
