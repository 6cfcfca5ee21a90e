//! Figures and tables as plain data: what a page, a screen and a file are made from.

use serde::Serialize;

use super::statistics::Comparison;

/// What a colour stands for, the same in all figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Robot and person learn together.
    Simultaneous,
    /// The robot only watches.
    Sequential,
    /// The person's action.
    Human,
    /// The robot's action.
    Machine,
    /// What both come to, and what all is compared with.
    Plain,
    /// One of many, such as a subject: its place among them.
    One(usize),
}

/// How many shapes can be told apart.
pub const SHAPES: usize = 6;

/// How a series is drawn. Shapes and dashes say what colours say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A thin line, for many of them.
    Thin,
    /// A small shape at each point: the n-th of them.
    Shape(usize),
    /// Line and shapes.
    Linked(usize),
    /// Dashed line and shapes.
    DashLinked(usize),
}

/// Some numbers that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// What they are, in the legend.
    pub label: String,
    /// What their colour stands for.
    pub role: Role,
    /// How they are drawn.
    pub mark: Mark,
    /// x and y. A point that is not finite breaks a line.
    pub points: Vec<(f64, f64)>,
    /// Around each point the least and the most, where there is a spread.
    pub spread: Option<Vec<(f64, f64)>>,
    /// Whose each point is, where each is a subject's; else nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub subjects: Vec<String>,
}

impl Series {
    /// A series without spread.
    #[must_use]
    pub fn new(label: impl Into<String>, role: Role, mark: Mark, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.into(), role, mark, points, spread: None, subjects: Vec::new() }
    }

    /// With this spread around its points.
    #[must_use]
    pub fn within(self, spread: Vec<(f64, f64)>) -> Self {
        Self { spread: Some(spread), ..self }
    }

    /// With these subjects, one a point.
    #[must_use]
    pub fn each_of(self, subjects: Vec<String>) -> Self {
        Self { subjects, ..self }
    }

    /// The unbroken parts of it.
    pub fn pieces(&self) -> impl Iterator<Item = &[(f64, f64)]> {
        self.pieces_within().into_iter().map(|(piece, _)| piece)
    }

    /// The unbroken parts of it, each with its part of the spread, where there is one.
    #[must_use]
    pub fn pieces_within(&self) -> Vec<Piece<'_>> {
        let is_whole = |&(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
        let mut from = 0;
        let mut pieces = Vec::new();
        for piece in self.points.split(|point| !is_whole(point)) {
            let spread = self.spread.as_ref().and_then(|all| all.get(from..from + piece.len()));
            from += piece.len() + 1;
            if !piece.is_empty() {
                pieces.push((piece, spread));
            }
        }
        pieces
    }
}

/// An unbroken part of a series, and its part of the spread.
pub type Piece<'a> = (&'a [(f64, f64)], Option<&'a [(f64, f64)]>);

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Axis {
    /// What is along it.
    pub label: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// The least and the most that is shown; else what there is.
    pub range: Option<(f64, f64)>,
    /// Words in place of numbers.
    pub names: Vec<(f64, String)>,
    /// Below which nothing can be, such as 0 of times: nothing below is shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// Whether only whole numbers are on it, as of counts.
    #[serde(skip)]
    pub is_whole: bool,
}

impl Axis {
    /// An axis of what there is.
    #[must_use]
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
    }

    /// An axis of whole numbers, without a unit.
    #[must_use]
    pub fn whole(label: impl Into<String>) -> Self {
        Self { is_whole: true, ..Self::new(label, "") }
    }

    /// From `least` to `most`.
    #[must_use]
    pub fn from(self, least: f64, most: f64) -> Self {
        Self { range: Some((least, most)), ..self }
    }

    /// Label and unit.
    #[must_use]
    pub fn title(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} ({})", self.label, self.unit)
        }
    }

    /// For the head of a column.
    #[must_use]
    pub fn column(&self) -> String {
        let word = |text: &str| text.replace(|c: char| !c.is_alphanumeric(), "_");
        match &*self.unit {
            "" => word(&self.label),
            "°" => format!("{}_deg", word(&self.label)),
            "°/s" => format!("{}_deg_s", word(&self.label)),
            "%" => format!("{}_percent", word(&self.label)),
            unit => format!("{}_{}", word(&self.label), word(unit)),
        }
    }
}

/// A number in each cell of a plane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cells {
    /// Rows from below, each from left to right; what is not finite is left blank.
    pub rows: Vec<Vec<f64>>,
    /// What the numbers are.
    pub label: String,
    /// Whether 0 is the middle of the colours.
    pub diverging: bool,
}

/// What a figure shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Content {
    /// Series over a common plane.
    Series(Vec<Series>),
    /// A number in each cell.
    Cells(Cells),
}

/// What figures and tables have in common.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Caption {
    /// Its name: that of its files, unique in a report.
    pub name: String,
    /// What it is in the thesis, such as `figure 14`; empty where it is ours.
    pub thesis: String,
    /// Its heading.
    pub title: String,
    /// Task and preset.
    pub preset: String,
    /// What it shows.
    pub sentence: String,
}

/// A figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// What it is.
    #[serde(flatten)]
    pub caption: Caption,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// What is shown.
    pub content: Content,
}

impl Figure {
    /// The least that is shown upwards, where 0 is near enough to be shown as well, or where
    /// nothing can be below it.
    #[must_use]
    pub fn ground(&self) -> Option<f64> {
        let Content::Series(series) = &self.content else { return None };
        let values = || {
            let spreads = series.iter().filter_map(|one| one.spread.as_ref()).flatten();
            let points = series.iter().flat_map(Series::pieces).flatten().map(|point| point.1);
            points.chain(spreads.map(|pair| pair.0)).filter(|value| value.is_finite())
        };
        let (least, most) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if self.y.range.is_some() {
            return None;
        }
        let floor = self.y.floor.filter(|floor| least < *floor);
        floor.or_else(|| (least >= 0.0 && least < 0.7 * most).then_some(0.0))
    }
}

/// A table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// What it is.
    #[serde(flatten)]
    pub caption: Caption,
    /// The heads of its columns, with units.
    pub columns: Vec<String>,
    /// Its rows; the first cell says what a row is.
    pub rows: Vec<Vec<String>>,
}

/// A figure or a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[expect(clippy::large_enum_variant, reason = "a report has some hundreds of them")]
pub enum Item {
    /// A figure.
    Figure(Figure),
    /// A table.
    Table(Table),
}

impl Item {
    /// What it is.
    #[must_use]
    pub const fn caption(&self) -> &Caption {
        match self {
            Self::Figure(figure) => &figure.caption,
            Self::Table(table) => &table.caption,
        }
    }

    /// What it is, to be changed.
    pub const fn caption_mut(&mut self) -> &mut Caption {
        match self {
            Self::Figure(figure) => &mut figure.caption,
            Self::Table(table) => &mut table.caption,
        }
    }

    /// The name of its data file.
    #[must_use]
    pub fn data_file(&self) -> String {
        format!("{}.csv", self.caption().name)
    }

    /// Its data, as the text of a CSV file.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut rows = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
        // Writing to memory cannot fail.
        let _ = match self {
            Self::Figure(figure) => figure.write_rows(&mut rows),
            Self::Table(table) => table.write_rows(&mut rows),
        };
        rows.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
    }
}

impl Figure {
    fn write_rows(&self, rows: &mut csv::Writer<Vec<u8>>) -> csv::Result<()> {
        let (x, y) = (self.x.column(), self.y.column());
        match &self.content {
            Content::Series(series) => {
                let has_subjects = series.iter().any(|one| !one.subjects.is_empty());
                let subject = has_subjects.then_some("subject");
                let head = ["series"].into_iter().chain(subject);
                rows.write_record(head.chain([&*x, &*y, "least", "most"]))?;
                for one in series {
                    for (index, (x, y)) in one.points.iter().enumerate() {
                        let spread = one.spread.as_ref().and_then(|spread| spread.get(index));
                        let (least, most) = spread.map_or((f64::NAN, f64::NAN), |pair| *pair);
                        let cells = [*x, *y, least, most].map(cell);
                        let subject = one.subjects.get(index).map_or("", String::as_str);
                        rows.write_record(
                            std::iter::once(one.label.as_str())
                                .chain(has_subjects.then_some(subject))
                                .chain(cells.iter().map(String::as_str)),
                        )?;
                    }
                }
            }
            Content::Cells(cells) => {
                rows.write_record([&*x, &*y, &*Axis::new(&*cells.label, "").column()])?;
                for (row, values) in cells.rows.iter().enumerate() {
                    for (column, value) in values.iter().enumerate() {
                        let at = [
                            middle(self.x.range, column, values.len()),
                            middle(self.y.range, row, cells.rows.len()),
                        ];
                        rows.write_record([cell(at[0]), cell(at[1]), cell(*value)])?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl Table {
    fn write_rows(&self, rows: &mut csv::Writer<Vec<u8>>) -> csv::Result<()> {
        rows.write_record(&self.columns)?;
        self.rows.iter().try_for_each(|row| rows.write_record(row))
    }
}

/// The middle of the cell `index` of `count` along an axis of `range`.
#[must_use]
pub fn middle(range: Option<(f64, f64)>, index: usize, count: usize) -> f64 {
    let (least, most) = range.unwrap_or((0.0, real(count)));
    least + (most - least) * (real(index) + 0.5) / real(count.max(1))
}

/// A number in the shortest form that reads back the same; nothing where it is none.
fn cell(value: f64) -> String {
    if value.is_finite() { format!("{value}") } else { String::new() }
}

/// A count as a number.
#[must_use]
pub fn real(count: usize) -> f64 {
    u32::try_from(count).map_or(f64::INFINITY, f64::from)
}

/// A part of a report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What a reader should know first.
    pub notes: Vec<String>,
    /// What it shows.
    pub items: Vec<Item>,
}

/// A comparison of two modes, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contrast {
    /// Task and preset.
    pub preset: String,
    /// What is compared,
    pub measure: String,
    /// and its unit; empty where it has none.
    pub unit: &'static str,
    /// The modes: the first is compared with the second.
    pub of: [&'static str; 2],
    /// What tells which values belong together; none where they are of groups of their own.
    pub paired_by: Option<&'static str>,
    /// What came of it.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// Something that is not in the report, and why.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct LeftOut {
    /// A file or a folder.
    pub path: String,
    /// Why, and what to do.
    pub why: String,
}

/// All of a report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// What it is of.
    pub title: String,
    /// Its parts.
    pub sections: Vec<Section>,
    /// Its comparisons of modes.
    pub comparisons: Vec<Contrast>,
    /// What is not in it.
    pub left_out: Vec<LeftOut>,
}

impl Report {
    /// All figures and tables, in order.
    pub fn items(&self) -> impl Iterator<Item = &Item> {
        self.sections.iter().flat_map(|section| &section.items)
    }

    /// Gives figures and tables of one name different ones.
    pub fn tell_names_apart(&mut self) {
        let mut taken = std::collections::BTreeSet::new();
        for item in self.sections.iter_mut().flat_map(|section| &mut section.items) {
            let name = item.caption().name.clone();
            let numbered = (2_u32..).map(|number| format!("{name}-{number}"));
            let free = std::iter::once(name.clone()).chain(numbered);
            if let Some(free) = free.into_iter().find(|name| taken.insert(name.clone())) {
                item.caption_mut().name = free;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(content: Content) -> Item {
        Item::Figure(Figure {
            caption: Caption { name: "a".to_owned(), ..Caption::default() },
            x: Axis::new("release angle", "°").from(0.0, 2.0),
            y: Axis::new("balance time", "s"),
            content,
        })
    }

    #[test]
    fn the_data_file_has_units_and_blanks_for_what_is_no_number() {
        let series =
            Series::new("main", Role::Plain, Mark::Line, vec![(1.0, 0.5), (2.0, f64::NAN)])
                .within(vec![(0.25, 0.75)]);
        let item = figure(Content::Series(vec![series]));
        assert_eq!(
            item.csv(),
            "series,release_angle_deg,balance_time_s,least,most\n\
             main,1,0.5,0.25,0.75\nmain,2,,,\n"
        );
    }

    #[test]
    fn the_data_file_names_the_subjects_of_points() {
        let mean = Series::new("mean", Role::Plain, Mark::Shape(0), vec![(1.0, 2.0)]);
        let each = Series::new("each", Role::Plain, Mark::Shape(0), vec![(1.0, 3.0)]);
        let item = figure(Content::Series(vec![mean, each.each_of(vec!["S01".to_owned()])]));
        assert_eq!(
            item.csv(),
            "series,subject,release_angle_deg,balance_time_s,least,most\n\
             mean,,1,2,,\neach,S01,1,3,,\n"
        );
    }

    #[test]
    fn a_spread_goes_no_lower_than_its_axis() {
        let points = vec![(1.0, 1.0)];
        let series = Series::new("a", Role::Plain, Mark::Line, points).within(vec![(-0.5, 2.5)]);
        let Item::Figure(mut figure) = figure(Content::Series(vec![series])) else { return };
        assert_eq!(figure.ground(), None);
        figure.y.floor = Some(0.0);
        assert_eq!(figure.ground(), Some(0.0));
    }

    #[test]
    fn cells_stand_at_their_middles() {
        let cells =
            Cells { rows: vec![vec![1.0, 2.0]], label: "value".to_owned(), diverging: false };
        let item = figure(Content::Cells(cells));
        assert_eq!(item.csv(), "release_angle_deg,balance_time_s,value\n0.5,0.5,1\n1.5,0.5,2\n");
    }

    #[test]
    fn a_series_falls_into_pieces() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (f64::NAN, 0.0), (2.0, 3.0)];
        let series = Series::new("a", Role::Plain, Mark::Line, points);
        assert_eq!(series.pieces().map(<[_]>::len).collect::<Vec<_>>(), [2, 1]);
        let spread: Vec<(f64, f64)> = (0..4).map(|at| (f64::from(at), 9.0)).collect();
        let series = series.within(spread.clone());
        let pieces = series.pieces_within();
        assert_eq!((pieces[0].1, pieces[1].1), (Some(&spread[..2]), Some(&spread[3..])));
    }

    #[test]
    fn no_two_items_write_one_file() {
        let item = figure(Content::Series(vec![]));
        let section =
            Section { items: vec![item.clone(), item.clone(), item], ..Section::default() };
        let mut report = Report { sections: vec![section], ..Report::default() };
        report.tell_names_apart();
        let names: Vec<&str> = report.items().map(|item| &*item.caption().name).collect();
        assert_eq!(names, ["a", "a-2", "a-3"]);
    }
}
