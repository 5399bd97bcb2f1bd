// Looking up blocks once all are made. Needs the bindings table, constants.

// The block with this key, or NONE.
fn find(key: u32) -> u32 {
    var entry = hash(key) & constants.table_mask;
    for (var probe = 0u; probe <= constants.table_mask; probe++) {
        let seen = table[entry].key;
        if seen == key + 1u {
            return table[entry].block;
        }
        if seen == 0u {
            break;
        }
        entry = (entry + 1u) & constants.table_mask;
    }
    return NONE;
}
