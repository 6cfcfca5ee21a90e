//! When receptive fields come and go.

use super::near::Near;

/// A new field takes after the nearest one if that is activated by more than this share of
/// `w_gen`.
const KINSHIP: f64 = 0.1;

/// How an update changed the set of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growth {
    /// Not at all.
    None,
    /// A field was appended.
    Added {
        /// Its index.
        field: usize,
        /// The field whose shape, rates and offset it took over.
        template: Option<usize>,
    },
    /// A field was removed. RFWR's later fields moved down, LWPR's last one took its place.
    Pruned {
        /// Its index before.
        field: usize,
        /// The overlapping field that stays, by its index before.
        survivor: usize,
    },
}

/// What should become of the set of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Nothing.
    Stay,
    /// A field should be added, perhaps like another one.
    Add(Option<usize>),
    /// One of these two, of which the first is activated more, should be removed.
    Prune(usize, usize),
}

/// The rules of growth.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// A field is added where no activation exceeds this.
    pub w_gen: f64,
    /// One of two fields is removed where the activations of both exceed this.
    pub w_prune: f64,
    /// Ours: with this many fields none is added.
    pub max_fields: Option<u32>,
}

impl Rules {
    /// What should happen to `fields` fields, of which these two were activated most;
    /// `trusted` tells which of them may be a template.
    pub fn wish(
        &self,
        [first, second]: [Near; 2],
        fields: usize,
        trusted: impl Fn(usize) -> bool,
    ) -> Wish {
        if let Some((first, w)) = first
            && w > self.w_gen
        {
            return match second {
                Some((second, w)) if w > self.w_prune => Wish::Prune(first, second),
                _ => Wish::Stay,
            };
        }
        if self.max_fields.is_some_and(|most| fields >= most as usize) {
            return Wish::Stay;
        }
        let kin = first.filter(|&(field, w)| w > KINSHIP * self.w_gen && trusted(field));
        Wish::Add(kin.map(|(field, _)| field))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_where_none_is_and_go_where_two_are() {
        let rules = Rules { w_gen: 0.2, w_prune: 0.9, max_fields: Some(3) };
        let wish = |two, fields| rules.wish(two, fields, |field| field != 1);
        assert_eq!(wish([None, None], 0), Wish::Add(None));
        assert_eq!(wish([Some((0, 0.1)), None], 2), Wish::Add(Some(0)));
        assert_eq!(wish([Some((1, 0.1)), None], 2), Wish::Add(None), "not trusted");
        assert_eq!(wish([Some((0, 0.01)), None], 2), Wish::Add(None), "too far");
        assert_eq!(wish([Some((0, 0.1)), None], 3), Wish::Stay, "full");
        assert_eq!(wish([Some((0, 0.2)), None], 1), Wish::Add(Some(0)), "not exceeded");
        assert_eq!(wish([Some((0, 0.5)), Some((1, 0.4))], 3), Wish::Stay);
        assert_eq!(wish([Some((2, 0.99)), Some((0, 0.95))], 3), Wish::Prune(2, 0));
    }
}
