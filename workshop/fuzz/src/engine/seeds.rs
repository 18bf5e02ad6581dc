//! The seeds of the fuzz target.

/// For each model, and for the last one with a change of it: healthy signals, one wrong, one silent, orders, strange times and shapes.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let well = [255, 5, 144, 144];
    let steps: [&[[u8; 4]]; 8] = [
        &[well, well, well],
        &[well, [160, 5, 144, 240], [160, 5, 144, 240], well],
        &[well, well, [7, 15, 144, 0], well, [1, 5, 144, 0], [1, 13, 2, 0], well],
        &[well, [0, 22, 144, 0], [1, 5, 144, 0], well],
        &[
            well,
            [0, 23, 144, 0],
            [2, 17, 144, 0x90],
            [3, 5, 3, 0xa9],
            [4, 5, 144, 11],
            [5, 5, 144, 13],
            [5, 5, 144, 12],
        ],
        &[
            well,
            [128, 5, 0, 2],
            [129, 5, 3, 0],
            well,
            [160, 5, 144, 240],
            [128, 5, 5, 2],
            [130, 5, 4, 0],
            well,
        ],
        &[
            [0, 0, 144, 0],
            [1, 0, 144, 0],
            [0, 0, 145, 0],
            [9, 1, 144, 0],
            [161, 20, 160, 120],
            [162, 19, 144, 2],
            well,
        ],
        // Told, overridden for a time, and denied.
        &[well, [128, 5, 7, 0], well, [128, 5, 6, 100], well, [3, 5, 20, 0], well, [128, 5, 8, 0], well],
    ];
    // The last model again, with a change of it after two inputs.
    let models = (0..6).chain([5 + 6 * 3]);
    models.flat_map(|model| steps.map(|steps| [&[model][..], steps.as_flattened()].concat())).collect()
}
