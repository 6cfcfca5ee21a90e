//! A short word for a long text, by which two texts are told apart.

use siphasher::sip128::{Hasher128, SipHasher13};
use std::hash::Hasher;

/// The fingerprint of some texts, in their order: 128 bits of SipHash 1-3 with a key that never
/// changes. Two studies that differ have the same one by chance once in 10^38. It is no seal:
/// whoever wants to can make two texts with the same one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fingerprint(SipHasher13);

impl Fingerprint {
    /// Takes in one more text.
    pub(super) fn take(&mut self, text: &str) {
        self.0.write(&(text.len() as u64).to_le_bytes());
        self.0.write(text.as_bytes());
    }

    /// It as 32 digits.
    pub(super) fn word(&self) -> String {
        let print = self.0.finish128();
        format!("{:016x}{:016x}", print.h1, print.h2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(texts: &[&str]) -> String {
        let mut print = Fingerprint::default();
        for text in texts {
            print.take(text);
        }
        print.word()
    }

    /// It stands in files: it must not change with the program. The number is that of a SipHash
    /// 1-3 of 128 bits written from its definition (Aumasson and Bernstein 2012).
    #[test]
    fn it_is_always_the_same_and_differs_with_every_text() {
        assert_eq!(word(&["gate", "0.5"]), "c377b6a190604d941475143feb554130");
        let all = [word(&[]), word(&[""]), word(&["ab"]), word(&["a", "b"]), word(&["b", "a"])];
        for (index, one) in all.iter().enumerate() {
            assert!(one.len() == 32 && !all[..index].contains(one), "{all:?}");
        }
    }
}
