//! Pieces of the page that are not plots.

use std::fmt::Display;

use super::plot::{self, escape};

/// What every page begins with.
pub const BEGIN: &str = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
     <meta name=\"generator\" content=\"stagger\"/>\n";

/// A whole page that needs nothing beside itself and asks for nothing. It is well-formed XML too.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "{BEGIN}<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n\
         <style>\n{}{}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escape(title),
        plot::STYLE,
        include_str!("page.css"),
    )
}

/// A number as people read it, with its value for programs under `key`.
pub fn data(key: &str, value: impl Display, shown: &str) -> String {
    format!("<data data-key=\"{}\" value=\"{value}\">{}</data>", escape(key), escape(shown))
}

/// A term and what is said of it, which is markup.
pub fn fact(term: &str, markup: &str) -> String {
    format!("<div><dt>{}</dt><dd>{markup}</dd></div>\n", escape(term))
}

/// A section with its heading; nothing where it is empty.
pub fn section(heading: &str, markup: &str) -> String {
    if markup.is_empty() {
        String::new()
    } else {
        format!("<section>\n<h2>{}</h2>\n{markup}</section>\n", escape(heading))
    }
}

/// Plots beside each other.
pub fn plots(figures: &[String]) -> String {
    if figures.is_empty() { String::new() } else { format!("<div class=\"plots\">\n{}</div>\n", figures.concat()) }
}

/// A table whose first `names` columns hold names, and the others numbers. Cells are markup.
pub fn table(head: &[&str], names: usize, rows: &[Vec<String>]) -> String {
    let class = |column: usize| if column < names { " class=\"name\"" } else { "" };
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = String>| {
        cells.enumerate().map(|(column, cell)| format!("<{tag}{}>{cell}</{tag}>", class(column))).collect::<String>()
    };
    let mut text = format!(
        "<div class=\"scroll\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n",
        cells("th", &mut head.iter().map(|title| escape(title)))
    );
    for row in rows {
        text += &format!("<tr>{}</tr>\n", cells("td", &mut row.iter().cloned()));
    }
    text + "</tbody></table></div>\n"
}

/// Wall clock as a date and time of day, UTC.
pub fn date(unix_ns: u64) -> String {
    let seconds = unix_ns / 1_000_000_000;
    let (days, of_day) = (seconds / 86_400, seconds % 86_400);
    // Civil date from days since 1970 (H. Hinnant, "chrono-compatible low-level date algorithms").
    let shifted = days + 719_468;
    let (era, of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00:00 UTC"),
            (951_782_399, "2000-02-28 23:59:59 UTC"),
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (1_700_000_000, "2023-11-14 22:13:20 UTC"),
            (4_107_542_399, "2100-02-28 23:59:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00:00 UTC"),
        ] {
            assert_eq!(date(seconds * 1_000_000_000), expected);
        }
    }

    #[test]
    fn names_are_escaped_and_values_exact() {
        assert_eq!(data("a\"b", 0.1, "<1>"), "<data data-key=\"a&quot;b\" value=\"0.1\">&lt;1&gt;</data>");
        assert_eq!(section("empty", ""), "");
    }
}
