//! Any bytes at all, in any pieces: no codec fails, and the pieces do not matter.

#![no_main]

use coadapt::backend::wire::{Codec, Counts, Format, Message, Refusal};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    for format in [Format::Sensorsini31, Format::Cobs1] {
        let pieces = usize::from(piece).max(1);
        // Floats that are no numbers equal nothing, not even themselves: compare the words.
        let [whole, cut] = [bytes.len().max(1), pieces].map(|size| {
            let (heard, counts) = hear(format.codec().as_mut(), bytes, size);
            (format!("{heard:?}"), counts)
        });
        assert_eq!(whole, cut);
    }
});

fn hear(
    codec: &mut dyn Codec,
    bytes: &[u8],
    size: usize,
) -> (Vec<Result<Message, Refusal>>, Counts) {
    let mut heard = Vec::new();
    for piece in bytes.chunks(size) {
        codec.take(piece);
        heard.extend(std::iter::from_fn(|| codec.hear()));
    }
    (heard, codec.counts())
}
