//! A report as one HTML file: nothing is fetched, by day and by night, on paper and on a phone.

use std::fmt::Write as _;

use super::draw;
use super::figure::{Figure, Item, Report, Section, Table};

/// How the page looks.
const STYLE: &str = include_str!("html/page.css");
/// Saves a figure as it is drawn, in the colours that are seen.
const SCRIPT: &str = include_str!("html/page.js");
/// Sections beyond which those of single sessions begin folded.
const MOST_OPEN: usize = 24;

/// The page of `report`, made by `version` of this program.
#[must_use]
pub fn page(report: &Report, version: &str) -> String {
    let mut page = String::with_capacity(1 << 20);
    // Writing to a text cannot fail.
    let _ = write_page(&mut page, report, version);
    page
}

fn write_page(page: &mut String, report: &Report, version: &str) -> std::fmt::Result {
    let title = escaped(&report.title);
    write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>{title} · coadapt</title><style>{}{STYLE}</style></head>\n<body>\n\
         <header><h1>{title}</h1><p>Made by coadapt {} from what sessions and studies left. Each figure \
         and table names its preset; presets are never pooled.</p></header>\n",
        draw::style(),
        escaped(version)
    )?;
    write_contents(page, report)?;
    write_left_out(page, report)?;
    let folds = report.sections.len() > MOST_OPEN;
    page.push_str("<main>\n");
    for (at, section) in report.sections.iter().enumerate() {
        write_section(page, section, at, folds)?;
    }
    write!(page, "</main>\n<script>{SCRIPT}</script>\n</body></html>\n")
}

fn write_contents(page: &mut String, report: &Report) -> std::fmt::Result {
    page.push_str("<nav aria-label=\"contents\"><ol>");
    for (at, section) in report.sections.iter().enumerate() {
        write!(page, "<li><a href=\"#part-{at}\">{}</a></li>", escaped(&section.title))?;
    }
    page.push_str("</ol></nav>\n");
    Ok(())
}

fn write_left_out(page: &mut String, report: &Report) -> std::fmt::Result {
    if report.left_out.is_empty() {
        return Ok(());
    }
    page.push_str("<aside><h2>Left out</h2><ul>");
    for left in &report.left_out {
        write!(page, "<li><code>{}</code>: {}</li>", escaped(&left.path), escaped(&left.why))?;
    }
    page.push_str("</ul></aside>\n");
    Ok(())
}

fn write_section(page: &mut String, section: &Section, at: usize, folds: bool) -> std::fmt::Result {
    let title = escaped(&section.title);
    // A group, a study or both modes of a subject is what one came for.
    let is_wanted = ["Group", "Study"].iter().any(|word| section.title.starts_with(word))
        || section.title.ends_with("both modes");
    let is_open = !folds || is_wanted;
    let open = if is_open { " open" } else { "" };
    writeln!(page, "<details id=\"part-{at}\"{open}><summary><h2>{title}</h2></summary>")?;
    for note in &section.notes {
        writeln!(page, "<p class=\"note\">{}</p>", escaped(note))?;
    }
    page.push_str("<div class=\"items\">\n");
    for item in &section.items {
        match item {
            Item::Figure(figure) => write_figure(page, item, figure)?,
            Item::Table(table) => write_table(page, item, table)?,
        }
    }
    page.push_str("</div></details>\n");
    Ok(())
}

/// Heading, preset and sentence.
fn write_caption(page: &mut String, item: &Item) -> std::fmt::Result {
    let caption = item.caption();
    let thesis = if caption.thesis.is_empty() {
        String::new()
    } else {
        format!("<span class=\"thesis\">{}</span> ", escaped(&caption.thesis))
    };
    write!(
        page,
        "<h3>{thesis}{}</h3><p class=\"preset\">{}</p>",
        escaped(&caption.title),
        escaped(&caption.preset)
    )
}

fn write_figure(page: &mut String, item: &Item, figure: &Figure) -> std::fmt::Result {
    let name = escaped(&figure.caption.name);
    write!(page, "<figure id=\"{name}\">")?;
    write_caption(page, item)?;
    page.push_str(&draw::for_page(figure));
    writeln!(
        page,
        "<figcaption>{} <span class=\"data\">Data: <code>{}</code>, \
         which <code>--csv DIR</code> writes. <button data-save=\"{name}\">save SVG</button></span></figcaption></figure>",
        escaped(&figure.caption.sentence),
        escaped(&item.data_file()),
    )
}

fn write_table(page: &mut String, item: &Item, table: &Table) -> std::fmt::Result {
    write!(page, "<figure class=\"table\" id=\"{}\">", escaped(&table.caption.name))?;
    write_caption(page, item)?;
    page.push_str("<div class=\"scroll\"><table><thead><tr>");
    for column in &table.columns {
        write!(page, "<th scope=\"col\">{}</th>", escaped(column))?;
    }
    page.push_str("</tr></thead><tbody>");
    for row in &table.rows {
        page.push_str("<tr>");
        for (at, cell) in row.iter().enumerate() {
            let cell = escaped(cell);
            if at == 0 {
                write!(page, "<th scope=\"row\">{cell}</th>")?;
            } else {
                write!(page, "<td>{cell}</td>")?;
            }
        }
        page.push_str("</tr>");
    }
    writeln!(
        page,
        "</tbody></table></div><figcaption>{} <span class=\"data\">Data: <code>{}</code>, \
         which <code>--csv DIR</code> writes.</span></figcaption></figure>",
        escaped(&table.caption.sentence),
        escaped(&item.data_file())
    )
}

/// For a place where HTML is read.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::{Axis, Caption, Content, LeftOut, Mark, Role, Series};

    fn report() -> Report {
        let caption = Caption {
            name: "a".to_owned(),
            thesis: "figure 14".to_owned(),
            title: "Time & more".to_owned(),
            preset: "balance · thesis".to_owned(),
            sentence: "What it shows.".to_owned(),
        };
        let figure = Figure {
            caption: caption.clone(),
            x: Axis::new("rollout", ""),
            y: Axis::new("time", "s"),
            content: Content::Series(vec![Series::new(
                "x",
                Role::Plain,
                Mark::Line,
                vec![(0.0, 1.0), (1.0, 2.0)],
            )]),
        };
        let table = Table {
            caption: Caption { name: "b".to_owned(), ..caption },
            columns: vec!["who".to_owned(), "time (s)".to_owned()],
            rows: vec![vec!["<S01>".to_owned(), "1.0".to_owned()]],
        };
        Report {
            title: "Report".to_owned(),
            sections: vec![Section {
                title: "S01".to_owned(),
                notes: vec!["A note.".to_owned()],
                items: vec![Item::Figure(figure), Item::Table(table)],
            }],
            comparisons: vec![],
            left_out: vec![LeftOut { path: "logs/x".to_owned(), why: "it is empty".to_owned() }],
        }
    }

    #[test]
    fn a_page_says_all_that_a_figure_must_and_fetches_nothing() {
        let page = page(&report(), "0.0.0");
        for wanted in [
            "figure 14",
            "Time &amp; more",
            "balance · thesis",
            "What it shows.",
            "a.csv",
            "b.csv",
            "--csv DIR",
            "time (s)",
            "&lt;S01&gt;",
            "logs/x",
            "it is empty",
            "prefers-color-scheme:dark",
            "@media print",
        ] {
            assert!(page.contains(wanted), "{wanted}");
        }
        // The name of SVG and the places within the page are no addresses that are fetched.
        let page = page.replace("http://www.w3.org/2000/svg", "").replace("url(#", "");
        for word in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!page.contains(word), "{word}");
        }
    }
}
