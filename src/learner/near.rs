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
            let near = window.may_count(q);
            if self.gathers {
                self.keep(block, near, q);
            } else if near.any_true() {
                let fields = fields(simd, block);
                // Of those that are not near, a nearer one may be in another block.
                self.nearest.note(fields, near.select(q, all(simd, f64::INFINITY)));
                return Some(Group { eight: indices(fields), q });
            }
        }
        Some(self.hand_out(simd))
    }

    /// The two nearest of all fields, which are among those handed out, if these are two.
    #[inline(always)]
    pub fn nearest(self, simd: S, shapes: &Shapes, x: &[f64]) -> [Near; 2] {
        match self.nearest.settle() {
            [None, _] => nearest_of_all(simd, shapes, x),
            // Its own metric may have been learned since, but not that of any other.
            [Some(first), None] => {
                let other = |near: &Near| near.is_some_and(|(field, _)| field != first.0);
                let next = nearest_of_all(simd, shapes, x).into_iter().find(other);
                [Some(first), next.flatten()]
            }
            two => two,
        }
    }

    /// Keeps the block's fields where the mask is true.
    #[inline(always)]
    fn keep(&mut self, block: usize, mask: Mask<S>, q: Lanes<S>) {
        let end = self.count + LANES;
        let fields = fields(q.simd, block).compress(mask);
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
        let (mut fields, mut q) = (Row::ZERO, Row::ZERO);
        for lane in 0..LANES {
            (fields.0[lane], q.0[lane]) = (self.found[lane], self.q[lane]);
            self.found[lane] = self.found[LANES + lane];
            self.q[lane] = self.q[LANES + lane];
        }
        self.count -= LANES;
        let (fields, q) = (fields.get(simd), q.get(simd));
        self.nearest.note(fields, q);
        Group { eight: indices(fields), q }
    }
}

/// The fields of a block, as numbers.
#[inline(always)]
fn fields<S: Simd>(simd: S, block: usize) -> Lanes<S> {
    const LANE: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    #[expect(clippy::cast_precision_loss, reason = "exact below 2⁵³ fields")]
    let first = (block * LANES) as f64;
    let lane: Lanes<S> = LANE.simd_into(simd);
    lane + first
}

/// Fields as indices.
#[inline(always)]
fn indices<S: Simd>(fields: Lanes<S>) -> Eight {
    let (mut eight, Row(fields)) = ([0; LANES], Row(fields.into()));
    for (index, field) in eight.iter_mut().zip(fields) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
        let field = field as usize;
        *index = field;
    }
    eight
}

/// The two nearest fields, wherever they are.
#[cold]
fn nearest_of_all<S: Simd>(simd: S, shapes: &Shapes, x: &[f64]) -> [Near; 2] {
    let mut nearest = Nearest::none(simd);
    for block in 0..shapes.blocks() {
        nearest.note(fields(simd, block), shapes.distance(simd, block, x));
    }
    nearest.settle()
}

/// The two fields nearest in their own metrics; of equally near ones the earlier is ahead.
/// Each lane keeps its own two until [`settle`](Self::settle), of fields noted in their order.
#[derive(Clone, Copy, Debug)]
struct Nearest<S: Simd> {
    /// The smallest q of a lane and whose it is,
    first: (Lanes<S>, Lanes<S>),
    /// and the next.
    second: (Lanes<S>, Lanes<S>),
}

/// A field and its q.
pub type Near = Option<(usize, f64)>;

impl<S: Simd> Nearest<S> {
    /// Nobody yet.
    #[inline(always)]
    fn none(simd: S) -> Self {
        let nobody = (all(simd, f64::INFINITY), all(simd, 0.0));
        Self { first: nobody, second: nobody }
    }

    /// Takes note of fields at `q`; a distance that is NaN or infinite is none.
    #[inline(always)]
    fn note(&mut self, fields: Lanes<S>, q: Lanes<S>) {
        let ahead = q.simd_lt(self.first.0);
        let next = q.simd_lt(self.second.0);
        self.second.0 = ahead.select(self.first.0, next.select(q, self.second.0));
        self.second.1 = ahead.select(self.first.1, next.select(fields, self.second.1));
        self.first.0 = ahead.select(q, self.first.0);
        self.first.1 = ahead.select(fields, self.first.1);
    }

    /// The nearest of all lanes, and the next.
    #[inline(always)]
    fn settle(self) -> [Near; 2] {
        let (mut q, mut fields) = (Row(self.first.0.into()), Row(self.first.1.into()));
        let (next_q, next) = (Row(self.second.0.into()), Row(self.second.1.into()));
        let lane = least(&q, &fields);
        let first = near(q.0[lane], fields.0[lane]);
        // Its lane's next is up against the first of the others.
        (q.0[lane], fields.0[lane]) = (next_q.0[lane], next.0[lane]);
        let lane = least(&q, &fields);
        [first, near(q.0[lane], fields.0[lane])]
    }
}

#[inline(always)]
fn near(q: f64, field: f64) -> Near {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let field = field as usize;
    q.is_finite().then_some((field, q))
}

/// The lane of the nearest of eight, of equally near ones the earliest.
#[inline(always)]
fn least(Row(q): &Row, Row(fields): &Row) -> usize {
    let mut best = 0;
    for lane in 1..LANES {
        let earlier = q[lane] == q[best] && fields[lane] < fields[best];
        if q[lane] < q[best] || earlier {
            best = lane;
        }
    }
    best
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
                nearest.note(fields(simd, block), q.simd_into(simd));
            }
            nearest.settle()
        }
    }

    #[test]
    fn nearest_keeps_the_two_nearest_and_the_earlier_of_equals() {
        let nan = f64::NAN;
        let far = [nan; 4];
        for (q, two) in [
            (
                vec![[5.0, nan, 3.0, 9.0], far, [3.0, 7.0, nan, nan], far],
                [Some((2, 3.0)), Some((8, 3.0))],
            ),
            (vec![[9.0; 4], [9.0, 8.0, 9.0, 9.0]], [Some((5, 8.0)), Some((0, 9.0))]),
            (
                vec![[2.0, 9.0, 9.0, 9.0], far, [1.0, 9.0, 9.0, 9.0], far],
                [Some((8, 1.0)), Some((0, 2.0))],
            ),
            (vec![[nan, 4.0, nan, nan], far], [Some((1, 4.0)), None]),
            (vec![], [None, None]),
        ] {
            let q: Vec<[f64; LANES]> = q
                .chunks(2)
                .map(|half| std::array::from_fn(|lane| half[lane / 4][lane % 4]))
                .collect();
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
            for &centre in &centres {
                shapes.push(&[centre], &[1.0]);
            }
            for (gathers, expected) in [(true, gathered), (false, blocks)] {
                let groups = run(Level::new(), Find(&shapes, gathers));
                let fields = |group: &Vec<(usize, f64)>| group.iter().map(|near| near.0).collect();
                let found: Vec<Vec<usize>> = groups.iter().map(fields).collect();
                assert_eq!(found, expected, "{centres:?}");
                assert!(groups.iter().flatten().all(|&(field, q)| q == centres[field].powi(2)));
            }
        }
    }

    struct Two<'a>(&'a Shapes, bool);

    impl Work for Two<'_> {
        type Output = [Near; 2];

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> [Near; 2] {
            let window = Window::new(Kernel::Gaussian, 2.0, 0.001);
            let mut search = Search::new(simd, self.1);
            while search.next(simd, (self.0, &window), &[0.0]).is_some() {}
            search.nearest(simd, self.0, &[0.0])
        }
    }

    #[test]
    fn the_nearest_two_may_be_in_blocks_without_a_near_field() {
        let mut shapes = Shapes::new(1, true);
        for centre in [0.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 6.0] {
            shapes.push(&[centre], &[1.0]);
        }
        for gathers in [true, false] {
            let two = run(Level::new(), Two(&shapes, gathers));
            assert_eq!(two, [Some((0, 0.0)), Some((8, 36.0))], "gathers: {gathers}");
        }
    }
}
