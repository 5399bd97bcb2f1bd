// The hash table from block keys to blocks: open addressing, linear probing. Needs the bindings table, constants.

// An entry of the table, and whether this call made it. `entry` is NONE if the table is full.
struct Found {
    entry: u32,
    made: bool,
}

fn find_or_insert(key: u32) -> Found {
    let wanted = key + 1u;
    var entry = hash(key) & constants.table_mask;
    for (var probe = 0u; probe <= constants.table_mask; probe++) {
        var seen = atomicLoad(&table[entry].key);
        while seen == 0u {
            // The weak exchange may fail spuriously; then it is tried again.
            let swap = atomicCompareExchangeWeak(&table[entry].key, 0u, wanted);
            if swap.exchanged {
                return Found(entry, true);
            }
            seen = swap.old_value;
        }
        if seen == wanted {
            return Found(entry, false);
        }
        entry = (entry + 1u) & constants.table_mask;
    }
    return Found(NONE, false);
}
