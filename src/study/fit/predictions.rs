//! What a learner answers to a table of queries.

use std::io::{Read, Write};

use super::{FitError, Progress, Stage, Watch};
use crate::learner::{Learner, Model};
use crate::study::table::Table;

/// Queries between two looks at whoever wants to stop.
const STRIDE: u64 = 256;

/// Writes a CSV table of the queries in `table`, whose columns are the `inputs`, and the
/// predictions of the `outputs`: with LWPR, each prediction with its standard deviation and
/// the largest activation of that output's fields; with RFWR, one largest activation. Every
/// number has 17 digits, as many as bring it back to the same bits.
///
/// Returns the number of queries; none when `watch` ended it. `length` is the table's in
/// bytes.
///
/// # Errors
/// When the table has faults or the disk refuses.
pub fn predict<R: Read>(
    learner: &Model,
    (inputs, outputs): (&[String], &[String]),
    (mut table, length): (Table<R>, u64),
    mut to: impl Write,
    watch: Watch<'_>,
) -> Result<Option<u64>, FitError> {
    let heads = inputs.iter().cloned().chain(heads_of(learner, outputs));
    to.write_all(csv_line(heads).as_bytes()).map_err(FitError::Write)?;
    let count = outputs.len();
    let mut x = vec![0.0; inputs.len()];
    let (mut y, mut conf, mut max_w) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
    let mut line = String::new();
    let mut queries = 0_u64;
    while table.next(&mut x)? {
        line.clear();
        put(&mut line, &x);
        match learner {
            Model::Lwpr(lwpr) => {
                lwpr.predict_with_confidence(&x, &mut y, &mut conf, &mut max_w);
                for ((y, conf), max_w) in y.iter().zip(&conf).zip(&max_w) {
                    put(&mut line, &[*y, *conf, *max_w]);
                }
            }
            Model::Rfwr(rfwr) => {
                let max_w = rfwr.predict(&x, &mut y);
                put(&mut line, &y);
                put(&mut line, &[max_w]);
            }
        }
        line.push('\n');
        to.write_all(line.as_bytes()).map_err(FitError::Write)?;
        queries += 1;
        #[expect(clippy::cast_precision_loss, reason = "a share for a progress bar")]
        let done = (table.bytes() as f64 / length.max(1) as f64).min(1.0);
        if queries.is_multiple_of(STRIDE)
            && !watch(Progress { stage: Stage::Predicting, done, fields: learner.fields() })
        {
            return Ok(None);
        }
    }
    to.flush().map_err(FitError::Write)?;
    Ok(Some(queries))
}

fn heads_of(learner: &Model, outputs: &[String]) -> Vec<String> {
    match learner {
        Model::Lwpr(_) => {
            let heads =
                |output: &String| ["pred", "conf", "max_w"].map(|word| format!("{word}_{output}"));
            outputs.iter().flat_map(heads).collect()
        }
        Model::Rfwr(_) => {
            let heads = outputs.iter().map(|output| format!("pred_{output}"));
            heads.chain(["max_w".to_owned()]).collect()
        }
    }
}

/// The names as a line, quoted where they need it.
fn csv_line(names: impl Iterator<Item = String>) -> String {
    let quoted = |name: String| {
        if name.contains([',', '"', '\n']) {
            format!("\"{}\"", name.replace('"', "\"\""))
        } else {
            name
        }
    };
    names.map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

/// Adds a cell for each of `numbers` to `line`.
fn put(line: &mut String, numbers: &[f64]) {
    for number in numbers {
        if !line.is_empty() {
            line.push(',');
        }
        line.push_str(&seventeen_digits(*number));
    }
}

/// A number with 17 significant digits and no closing zeros, as C's `%.17g` prints it.
fn seventeen_digits(number: f64) -> String {
    let scientific = format!("{number:.16e}");
    let Some((digits, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or_default();
    let text = match usize::try_from(16 - exponent) {
        Ok(decimals) if exponent >= -4 => format!("{number:.decimals$}"),
        _ => digits.to_owned(),
    };
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    };
    if (-4..17).contains(&exponent) {
        return text;
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{text}e{sign}{:02}", exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_look_as_c_prints_them() {
        for (number, text) in [
            (0.0, "0"),
            (-1.0, "-1"),
            (0.1, "0.10000000000000001"),
            (1e20, "1e+20"),
            (1e16, "10000000000000000"),
            (1e17, "1e+17"),
            (1e-4, "0.0001"),
            (1e-5, "1.0000000000000001e-05"),
            (-1.1, "-1.1000000000000001"),
            (1.5e-300, "1.5000000000000001e-300"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(seventeen_digits(number), text);
        }
    }

    proptest! {
        #[test]
        fn numbers_come_back_to_the_same_bits(number in proptest::num::f64::NORMAL) {
            let back: f64 = seventeen_digits(number).parse().unwrap();
            prop_assert_eq!(back.to_bits(), number.to_bits());
        }
    }
}
