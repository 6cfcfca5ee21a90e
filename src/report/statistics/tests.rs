//! Against published numbers, and against SciPy 1.17.1 (with NumPy 2.4.6) and pingouin 0.7.0, called
//! as the tests say.

use proptest::prelude::*;

use super::{Comparison, MOST_ARRANGEMENTS, Test, compare, compare_paired, interval95};

/// Survival of mice in days, with and without treatment: Efron & Tibshirani (1993), table 2.1.
const TREATED: [f64; 7] = [94.0, 197.0, 16.0, 38.0, 99.0, 141.0, 23.0];
const UNTREATED: [f64; 9] = [52.0, 104.0, 146.0, 10.0, 51.0, 30.0, 40.0, 27.0, 46.0];

/// Heights of 15 pairs of maize in inches, crossed and self-fertilised: Darwin (1876), table XCVII.
const CROSSED: [f64; 15] = [
    23.5, 12.0, 21.0, 22.0, 19.125, 21.5, 22.125, 20.375, 18.25, 21.625, 23.25, 21.0, 22.125, 23.0,
    12.0,
];
const SELFED: [f64; 15] = [
    17.375, 20.375, 20.0, 20.0, 18.375, 18.625, 18.625, 15.25, 16.5, 18.0, 16.25, 18.0, 12.75,
    15.5, 18.0,
];

/// Ten people's marks of two films: Lakens (2013), table 1.
const FILM_1: [f64; 10] = [9.0, 7.0, 8.0, 9.0, 8.0, 9.0, 9.0, 10.0, 9.0, 9.0];
const FILM_2: [f64; 10] = [9.0, 6.0, 7.0, 8.0, 7.0, 9.0, 8.0, 8.0, 8.0, 7.0];

/// Large groups: k² mod 31 for k = 1 … 40, and k³ mod 37 for k = 1 … 30.
fn large() -> (Vec<f64>, Vec<f64>) {
    let squares = (1..=40).map(|k: u32| f64::from(k.pow(2) % 31)).collect();
    (squares, (1..=30).map(|k: u32| f64::from(k.pow(3) % 37)).collect())
}

#[track_caller]
fn close(value: f64, wanted: f64, within: f64) {
    assert!((value - wanted).abs() <= within, "{value} is not {wanted} ± {within}");
}

/// `permutation_test((treated, untreated), lambda x, y, axis: abs(mean(x) - mean(y)),
/// n_resamples=inf, alternative='greater')`; the book's table 2.1 has the difference 30.63.
#[test]
fn the_mice_differ_as_the_book_and_scipy_say() {
    let mice = compare(&TREATED, &UNTREATED, 1).unwrap();
    assert_eq!(mice.test, Test::Permutation { arrangements: 11440 });
    close(mice.difference, 30.63, 0.005);
    close(mice.p, 0.2783216783216783, 1e-15);
    close(mice.smallest_p.unwrap(), 1.0 / 11440.0, 1e-18);
    assert_eq!((mice.n, mice.median), ((7, 9), (94.0, 46.0)));
    close(mice.hedges_g.unwrap(), 0.5339485979189658, 1e-12);
    // `compute_effsize(eftype='hedges')` of pingouin, whose correction is the usual approximation.
    close(mice.hedges_g.unwrap(), 0.5340428245183723, 2e-4);
}

/// Fisher (1935), § 21: in 863 of the 32,768 ways the sum is at least as large as it was, so in
/// 1726 it is as far from 0. He gives t = 2.148 for the t-test.
#[test]
fn darwins_maize_differs_as_fisher_says() {
    let maize = compare_paired(&CROSSED, &SELFED, 1).unwrap();
    assert_eq!(maize.test, Test::PairedPermutation { arrangements: 32768 });
    assert_eq!(maize.p, 1726.0 / 32768.0);
    assert_eq!(maize.smallest_p, Some(1.0 / 16384.0));
    close(maize.hedges_g.unwrap(), 0.8658197963192061, 1e-12);
    let differences: Vec<f64> = CROSSED.iter().zip(SELFED).map(|(a, b)| a - b).collect();
    let student = super::student::paired(&differences).unwrap();
    close(student.t, 2.148, 0.0005);
    // `ttest_rel(crossed, selfed)`
    close(student.t, 2.1479874613311205, 1e-12);
    close(student.p, 0.049702944021800866, 1e-12);
}

/// Lakens (2013), table 1 and text: means 8.7 and 7.7, sd 0.82 and 0.95; t(9) = 4.74, p = .001;
/// Hedges' g 1.08, paired as unpaired.
#[test]
fn the_films_differ_as_lakens_says() {
    let apart = compare(&FILM_1, &FILM_2, 1).unwrap();
    let paired = compare_paired(&FILM_1, &FILM_2, 1).unwrap();
    close(apart.mean.0, 8.7, 1e-12);
    close(apart.mean.1, 7.7, 1e-12);
    close(apart.sd.0, 0.82, 0.005);
    close(apart.sd.1, 0.95, 0.005);
    for comparison in [apart, paired] {
        close(comparison.hedges_g.unwrap(), 1.08, 0.005);
        close(comparison.hedges_g.unwrap(), 1.0781948994631712, 1e-12);
    }
    // `permutation_test` of SciPy as above; paired with `permutation_type='samples'`.
    assert_eq!(apart.test, Test::Permutation { arrangements: 184756 });
    close(apart.p, 0.04003117625408647, 1e-15);
    assert_eq!(paired.test, Test::PairedPermutation { arrangements: 1024 });
    assert_eq!(paired.p, 0.0078125);
    // `ttest_ind(equal_var=False)` and `ttest_rel`.
    let welch = super::student::welch(&FILM_1, &FILM_2).unwrap();
    close(welch.t, 2.517544074890065, 1e-12);
    close(welch.df, 17.649873565454193, 1e-11);
    close(welch.p, 0.021719920951262406, 1e-12);
    let differences: Vec<f64> = FILM_1.iter().zip(FILM_2).map(|(a, b)| a - b).collect();
    let student = super::student::paired(&differences).unwrap();
    close(student.t, 4.743416490252569, 1e-12);
    close(student.p, 0.001053871257016554, 1e-14);
}

/// `ttest_ind(equal_var=False)` and `ttest_rel` of SciPy.
#[test]
fn large_groups_are_tested_by_students_t() {
    let (a, b) = large();
    let apart = compare(&a, &b, 1).unwrap();
    let Test::Welch { t, df } = apart.test else { panic!("{:?}", apart.test) };
    close(t, -2.7342557506401675, 1e-12);
    close(df, 51.79385558237161, 1e-10);
    close(apart.p, 0.008537365888196802, 1e-12);
    let paired = compare_paired(&a[..30], &b, 1).unwrap();
    let Test::PairedT { t, df } = paired.test else { panic!("{:?}", paired.test) };
    close(t, -2.462735438579177, 1e-12);
    assert_eq!(df, 29.0);
    close(paired.p, 0.01996725691328157, 1e-12);
    assert_eq!((apart.smallest_p, paired.smallest_p), (None, None));
}

/// `bootstrap(…, method='BCa', n_resamples=400000)`: its own ends move by up to 0.5 of the mice's
/// 105 days from seed to seed.
#[test]
fn intervals_are_those_of_scipy() {
    let (low, high) = compare(&TREATED, &UNTREATED, 1).unwrap().interval95.unwrap();
    close(low, -19.3, 2.0);
    close(high, 85.9, 2.0);
    let (low, high) = compare_paired(&CROSSED, &SELFED, 1).unwrap().interval95.unwrap();
    close(low, -0.20833, 0.15);
    close(high, 4.54167, 0.1);
    // A skewed sample, of which the percentile bootstrap says 2.3 to 15.2.
    let skewed = [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 5.0, 8.0, 40.0];
    let (low, high) = interval95(&skewed, 1).unwrap();
    close(low, 2.8, 0.11);
    close(high, 21.3, 0.7);
}

/// Four subjects in each mode, as in the thesis: of 70 arrangements two are the most extreme.
#[test]
fn the_smallest_p_is_what_the_sizes_allow() {
    let (low, high) = ([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]);
    let apart = compare(&low, &high, 1).unwrap();
    assert_eq!((apart.p, apart.smallest_p), (2.0 / 70.0, Some(2.0 / 70.0)));
    let uneven = compare(&low[..2], &high, 1).unwrap();
    assert_eq!((uneven.p, uneven.smallest_p), (1.0 / 15.0, Some(1.0 / 15.0)));
    let paired = compare_paired(&low, &high, 1).unwrap();
    assert_eq!((paired.p, paired.smallest_p), (2.0 / 16.0, Some(2.0 / 16.0)));
}

#[test]
fn what_cannot_be_compared_is_not() {
    let two = [1.0, 2.0];
    for bad in [&[][..], &[1.0], &[1.0, f64::NAN], &[1.0, f64::INFINITY], &[1e200, -1e200]] {
        assert_eq!(compare(bad, &two, 1), None, "{bad:?}");
        assert_eq!(compare(&two, bad, 1), None, "{bad:?}");
        assert_eq!(compare_paired(bad, &two, 1), None, "{bad:?}");
        assert_eq!(compare_paired(&two, bad, 1), None, "{bad:?}");
    }
    assert_eq!(compare_paired(&two, &[1.0, 2.0, 3.0], 1), None);
    assert_eq!(interval95(&[1.0], 1), None);
    assert_eq!(interval95(&[1.0, f64::NAN], 1), None);
}

#[test]
fn values_without_spread_have_a_chance_and_no_effect_size() {
    let same = compare(&[7.0; 4], &[7.0; 4], 1).unwrap();
    assert_eq!((same.p, same.difference, same.hedges_g), (1.0, 0.0, None));
    assert_eq!(same.interval95, Some((0.0, 0.0)));
    let apart = compare(&[7.0; 4], &[9.0; 4], 1).unwrap();
    assert_eq!((apart.p, apart.difference, apart.hedges_g), (2.0 / 70.0, -2.0, None));
    assert_eq!(apart.interval95, Some((-2.0, -2.0)));
    let many = compare(&[7.0; 40], &[9.0; 40], 1).unwrap();
    assert_eq!(many.test, Test::Welch { t: f64::NEG_INFINITY, df: 78.0 });
    assert_eq!(many.p, f64::MIN_POSITIVE);
    let many = compare(&[7.0; 40], &[7.0; 40], 1).unwrap();
    assert_eq!((many.test, many.p), (Test::Welch { t: 0.0, df: 78.0 }, 1.0));
    let b = large().1;
    let above: Vec<f64> = b.iter().map(|value| value + 1.0).collect();
    let shifted = compare_paired(&b, &above, 1).unwrap();
    assert_eq!(shifted.test, Test::PairedT { t: f64::NEG_INFINITY, df: 29.0 });
    assert_eq!((shifted.p, shifted.interval95), (f64::MIN_POSITIVE, Some((-1.0, -1.0))));
}

/// 22 values in two groups of 11 and 20 pairs are looked at one by one, more are not.
#[test]
fn the_exact_tests_end_where_they_say() {
    let values: Vec<f64> = (0..42).map(|k| f64::from(k * k % 23)).collect();
    let arrangements = |a: usize, b: usize| {
        let test = compare(&values[..a], &values[a..a + b], 1).unwrap().test;
        if let Test::Permutation { arrangements } = test { Some(arrangements) } else { None }
    };
    assert_eq!(arrangements(11, 11), Some(705_432));
    assert_eq!(arrangements(12, 11), None);
    assert_eq!(arrangements(2, 40), Some(861));
    let paired = |n: usize| compare_paired(&values[..n], &values[21..21 + n], 1).unwrap().test;
    let all = u64::from(MOST_ARRANGEMENTS);
    assert_eq!(paired(20), Test::PairedPermutation { arrangements: all });
    assert!(matches!(paired(21), Test::PairedT { .. }));
}

#[test]
fn a_sentence_says_how_its_numbers_were_found() {
    let sentence = |comparison: Option<Comparison>| comparison.unwrap().to_string();
    assert_eq!(
        sentence(compare(&[1.0, 2.0, 3.0, 4.0], &[5.0, 6.0, 7.0, 8.0], 1)),
        "mean 2.50 against 6.50, a difference of -4.00 (95 % BCa interval -5.50 to -2.50; Hedges' g \
         -2.69); medians 2.50 and 6.50, sd 1.29 and 1.29, n = 4 and 4; exact permutation test of all \
         70 arrangements, two-sided: p = 0.0286 (with these sizes no p below 0.0286 is possible)"
    );
    let (a, b) = large();
    let large = sentence(compare_paired(&a[..30], &b, 1));
    assert!(large.contains("n = 30 pairs; paired t-test, t(29) = -2.46, two-sided: p = 0.0200"));
    assert!(!large.contains("possible"), "{large}");
    let equal = sentence(compare(&[7.0; 40], &[9.0; 40], 1));
    assert!(equal.contains("no effect size without spread"), "{equal}");
    assert!(equal.contains("p < 0.0001"), "{equal}");
}

fn group() -> impl Strategy<Value = Vec<f64>> {
    // Few decimals, so that some values are equal.
    prop::collection::vec((-400_i32..400).prop_map(|value| f64::from(value) / 8.0), 2..9)
}

fn pairs() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    prop::collection::vec((-400_i32..400, -400_i32..400), 2..9).prop_map(|pairs| {
        pairs.into_iter().map(|(a, b)| (f64::from(a) / 8.0, f64::from(b) / 8.0)).unzip()
    })
}

type Compare = fn(&[f64], &[f64], u64) -> Option<Comparison>;

const BOTH: [Compare; 2] = [compare, compare_paired];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_chance_is_one((a, b) in pairs(), c in group()) {
        for comparison in BOTH.map(|by| by(&a, &b, 1)).into_iter().chain([compare(&a, &c, 1)]) {
            let Comparison { p, smallest_p, interval95, .. } = comparison.unwrap();
            prop_assert!(p > 0.0 && p <= 1.0 && p >= smallest_p.unwrap());
            let (low, high) = interval95.unwrap();
            prop_assert!(low <= high);
        }
    }

    #[test]
    fn swapped_groups_mirror_the_result((a, b) in pairs()) {
        for by in BOTH {
            let (there, back) = (by(&a, &b, 1).unwrap(), by(&b, &a, 1).unwrap());
            prop_assert_eq!(there.difference, -back.difference);
            prop_assert_eq!(there.hedges_g, back.hedges_g.map(|g| -g));
            prop_assert_eq!((there.p, there.smallest_p), (back.p, back.smallest_p));
            // A group that is its own mirror image meets the same chance from both sides.
            let (low, high) = back.interval95.unwrap();
            if there.difference != 0.0 {
                prop_assert_eq!(there.interval95, Some((-high, -low)));
            }
        }
    }

    #[test]
    fn neither_zero_nor_unit_matter((a, b) in pairs(), shift in -50.0..50.0, scale in 0.01..100.0) {
        let moved = |values: &[f64]| -> Vec<f64> {
            values.iter().map(|value| (value + shift) * scale).collect()
        };
        for by in BOTH {
            let (plain, other) = (by(&a, &b, 1).unwrap(), by(&moved(&a), &moved(&b), 1).unwrap());
            prop_assert_eq!(plain.p, other.p);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * (1.0 + a.abs().max(b.abs()));
            prop_assert!(near(plain.difference * scale, other.difference));
            if let Some(g) = plain.hedges_g {
                prop_assert!(near(g, other.hedges_g.unwrap()));
            }
            let ((low, high), (low_2, high_2)) = (plain.interval95.unwrap(), other.interval95.unwrap());
            prop_assert!(near(low * scale, low_2) && near(high * scale, high_2));
        }
    }
}
