// Looks up blocks once all of them are made. Needs the bindings table, constants.

// The entry of the block with this key, or NONE.
fn find_entry(key: u32) -> u32 {
    var entry = hash(key) & constants.table_mask;
    for (var probe = 0u; probe <= constants.table_mask; probe++) {
        let seen = table[entry].key;
        if seen == key + 1u {
            return entry;
        }
        if seen == 0u {
            break;
        }
        entry = (entry + 1u) & constants.table_mask;
    }
    return NONE;
}

// The block with this key, or NONE.
fn find(key: u32) -> u32 {
    let entry = find_entry(key);
    if entry == NONE {
        return NONE;
    }
    return table[entry].block;
}
