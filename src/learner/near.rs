//! Which receptive fields a sample concerns.

use fearless_simd::prelude::*;

use super::kernel::Window;
use super::lanes::{Eight, LANES, Lanes, Mask, Row, all};
use super::shapes::Shapes;

/// Walks over all fields: notes the nearest, and hands out those that may be active, eight at
/// a time.
#[derive(Debug)]
pub struct Search<S: Simd> {
    /// Whether fields of different blocks may go together.
    gathers: bool,
    /// The next block of fields to be looked at.
    block: usize,
    /// The fields found and not yet handed out,
    found: [f64; 2 * LANES],
    /// and their squared distances.
    q: [f64; 2 * LANES],
    count: usize,
    nearest: Nearest<S>,
}

/// Eight fields; or fewer, and the last places are nobody's.
#[derive(Clone, Copy, Debug)]
pub struct Group<S: Simd> {
    /// Which; in nobody's place is another of them, or none.
    pub eight: Eight,
    /// Their squared distances; infinite or NaN in nobody's place.
    pub q: Lanes<S>,
}

impl<S: Simd> Search<S> {
    /// Before the first field.
    #[inline(always)]
    pub fn new(simd: S, gathers: bool) -> Self {
        let (found, q) = ([0.0; 2 * LANES], [0.0; 2 * LANES]);
        Self { gathers, block: 0, found, q, count: 0, nearest: Nearest::none(simd) }
    }

    /// The next fields that may be active at `x`.
    #[inline(always)]
    pub fn next(
        &mut self,
        simd: S,
        (shapes, window): (&Shapes, &Window),
        x: &[f64],
    ) -> Option<Group<S>> {
        while self.count < LANES {
            if self.block == shapes.blocks() {
                return self.last(simd);
            }
            let block = self.block;
            self.block += 1;
            let q = shapes.distance(simd, block, x);
            self.nearest.note(block, q);
            let near = window.may_count(q);
            if self.gathers {
                self.keep(block, near, q);
            } else if near.any_true() {
                let mut eight = [block * LANES; LANES];
                for (lane, field) in eight.iter_mut().enumerate() {
                    *field += lane;
                }
                return Some(Group { eight, q });
            }
        }
        Some(self.hand_out(simd))
    }

    /// The two nearest of the fields looked at.
    #[inline(always)]
    pub fn nearest(self) -> [Near; 2] {
        self.nearest.settle()
    }

    /// Keeps the block's fields where the mask is true.
    #[inline(always)]
    fn keep(&mut self, block: usize, mask: Mask<S>, q: Lanes<S>) {
        const PLACES: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        #[expect(clippy::cast_precision_loss, reason = "exact below 2⁵³ fields")]
        let first = (block * LANES) as f64;
        let fields: Lanes<S> = PLACES.simd_into(q.simd);
        let fields = (fields + first).compress(mask);
        let end = self.count + LANES;
        self.found[self.count..end].copy_from_slice(&Row(fields.into()).0);
        self.q[self.count..end].copy_from_slice(&Row(q.compress(mask).into()).0);
        self.count += mask.to_bitmask().count_ones() as usize;
    }

    /// Those that are left when all fields were looked at.
    #[inline(always)]
    fn last(&mut self, simd: S) -> Option<Group<S>> {
        if self.count == 0 {
            return None;
        }
        for lane in self.count..LANES {
            (self.found[lane], self.q[lane]) = (self.found[0], f64::INFINITY);
        }
        self.count = LANES;
        Some(self.hand_out(simd))
    }

    /// The first eight of those found.
    #[inline(always)]
    fn hand_out(&mut self, simd: S) -> Group<S> {
        let (mut eight, mut q) = ([0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a field")]
            let field = self.found[lane] as usize;
            (eight[lane], q[lane]) = (field, self.q[lane]);
            self.found[lane] = self.found[LANES + lane];
            self.q[lane] = self.q[LANES + lane];
        }
        self.count -= LANES;
        Group { eight, q: q.simd_into(simd) }
    }
}

/// The two fields nearest in their own metrics; of equally near ones the earlier is ahead.
/// Each lane keeps its own two until [`settle`](Self::settle).
#[derive(Clone, Copy, Debug)]
pub struct Nearest<S: Simd> {
    /// The smallest q of a lane and the block that it is in,
    first: (Lanes<S>, Lanes<S>),
    /// and the next.
    second: (Lanes<S>, Lanes<S>),
}

/// A field and its q.
pub type Near = Option<(usize, f64)>;

impl<S: Simd> Nearest<S> {
    /// Nobody yet.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let nobody = (all(simd, f64::INFINITY), all(simd, -1.0));
        Self { first: nobody, second: nobody }
    }

    /// Takes note of a block's fields at `q`; a NaN distance is no distance.
    #[inline(always)]
    pub fn note(&mut self, block: usize, q: Lanes<S>) {
        #[expect(clippy::cast_precision_loss, reason = "exact below 2⁵³ blocks")]
        let here = all(q.simd, block as f64);
        let ahead = q.simd_lt(self.first.0);
        let next = q.simd_lt(self.second.0);
        self.second.0 = ahead.select(self.first.0, next.select(q, self.second.0));
        self.second.1 = ahead.select(self.first.1, next.select(here, self.second.1));
        self.first.0 = ahead.select(q, self.first.0);
        self.first.1 = ahead.select(here, self.first.1);
    }

    /// The nearest of all lanes, and the next.
    #[inline(always)]
    pub fn settle(self) -> [Near; 2] {
        let mut two: [Near; 2] = [None; 2];
        for (q, block) in [self.first, self.second] {
            let (Row(q), Row(block)) = (Row(q.into()), Row(block.into()));
            for lane in 0..LANES {
                if block[lane] < 0.0 {
                    continue;
                }
                #[expect(clippy::cast_possible_truncation, reason = "a block's index")]
                #[expect(clippy::cast_sign_loss, reason = "checked above")]
                let near = (block[lane] as usize * LANES + lane, q[lane]);
                if is_ahead(near, two[0]) {
                    two = [Some(near), two[0]];
                } else if is_ahead(near, two[1]) {
                    two[1] = Some(near);
                }
            }
        }
        two
    }
}

#[inline(always)]
fn is_ahead(near: (usize, f64), other: Near) -> bool {
    other.is_none_or(|other| near.1 < other.1 || near.1 == other.1 && near.0 < other.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::kernel::Kernel;
    use crate::learner::lanes::{Work, run};
    use fearless_simd::Level;

    struct Note(Vec<[f64; LANES]>);

    impl Work for Note {
        type Output = [Near; 2];

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> [Near; 2] {
            let mut nearest = Nearest::none(simd);
            for (block, q) in self.0.into_iter().enumerate() {
                nearest.note(block, q.simd_into(simd));
            }
            nearest.settle()
        }
    }

    #[test]
    fn nearest_keeps_the_two_nearest_and_the_earlier_of_equals() {
        let nan = f64::NAN;
        let far = [nan; 4];
        for (q, two) in [
            (vec![[5.0, nan, 3.0, 9.0], far, [3.0, 7.0, nan, nan], far], [Some((2, 3.0)), Some((8, 3.0))]),
            (vec![[9.0; 4], [9.0, 8.0, 9.0, 9.0]], [Some((5, 8.0)), Some((0, 9.0))]),
            (vec![[2.0, 9.0, 9.0, 9.0], far, [1.0, 9.0, 9.0, 9.0], far], [Some((8, 1.0)), Some((0, 2.0))]),
            (vec![[nan, 4.0, nan, nan], far], [Some((1, 4.0)), None]),
            (vec![], [None, None]),
        ] {
            let q: Vec<[f64; LANES]> = q.chunks(2).map(|half| {
                std::array::from_fn(|lane| half[lane / 4][lane % 4])
            }).collect();
            assert_eq!(run(Level::new(), Note(q.clone())), two, "{q:?}");
        }
    }

    struct Find<'a>(&'a Shapes, bool);

    impl Work for Find<'_> {
        type Output = Vec<Vec<(usize, f64)>>;

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> Self::Output {
            let window = Window::new(Kernel::Gaussian, 2.0, 0.001);
            let (mut search, mut groups) = (Search::new(simd, self.1), Vec::new());
            while let Some(Group { eight, q }) = search.next(simd, (self.0, &window), &[0.0]) {
                let group = eight.into_iter().zip(Row(q.into()).0);
                groups.push(group.filter(|(_, q)| q.is_finite()).collect());
            }
            groups
        }
    }

    #[test]
    fn near_fields_are_handed_out_eight_at_a_time() {
        let (near, far) = (1.0, 9.0);
        let mixed = [vec![near; 2], vec![far; 9], vec![near; 5], vec![far], vec![near; 3]];
        for (centres, gathered, blocks) in [
            (vec![], vec![], vec![]),
            (vec![far; 9], vec![], vec![]),
            (vec![far, near], vec![vec![1]], vec![vec![0, 1]]),
            (
                mixed.concat(),
                vec![vec![0, 1, 11, 12, 13, 14, 15, 17], vec![18, 19]],
                vec![(0..8).collect(), (8..16).collect(), (16..20).collect()],
            ),
            (
                vec![near; 16],
                vec![(0..8).collect(), (8..16).collect()],
                vec![(0..8).collect(), (8..16).collect()],
            ),
        ] {
            let mut shapes = Shapes::new(1, true);
            centres.iter().for_each(|&centre| shapes.push(&[centre], &[1.0]));
            for (gathers, expected) in [(true, gathered), (false, blocks)] {
                let groups = run(Level::new(), Find(&shapes, gathers));
                let fields = |group: &Vec<(usize, f64)>| group.iter().map(|near| near.0).collect();
                let found: Vec<Vec<usize>> = groups.iter().map(fields).collect();
                assert_eq!(found, expected, "{centres:?}");
                assert!(groups.iter().flatten().all(|&(field, q)| q == centres[field].powi(2)));
            }
        }
    }
}
