//! The task of a lesson as a part of a page, made of its document.

use pulldown_cmark::{html, Event, Options, Parser, Tag, TagEnd};

/// What the lines begin with that are not for the page: links to other lessons, and commands for a terminal. The page has
/// the machine and the check, and a simulated TXT beside it would find its ports in use.
const ELSEWHERE: [&str; 8] = [
    "[Contents](",
    "[Inhalt](",
    "Next: [",
    "Weiter: [",
    "Simulated: `",
    "Simuliert: `",
    "**Check.**",
    "**Prüfen.**",
];

/// The document without its links and lines that are not for the page.
pub(super) fn html(document: &str) -> String {
    let document = document.replace("\r\n", "\n");
    let is_elsewhere = |line: &&str| ELSEWHERE.iter().any(|begin| line.starts_with(begin));
    let text: Vec<_> = document.lines().filter(|line| !is_elsewhere(line)).collect();
    let text = text.join("\n");
    let mut is_solution = false;
    let events = Parser::new_ext(&text, Options::ENABLE_TABLES).filter(|event| {
        match event {
            Event::Start(Tag::Link { dest_url, .. }) => {
                is_solution = dest_url.contains("solutions")
            }
            Event::End(TagEnd::Link) => is_solution = false,
            _ => return !is_solution,
        }
        false
    });
    let mut html = String::new();
    html::push_html(&mut html, events);
    html
}

#[cfg(test)]
mod tests {
    use super::super::lesson::LESSONS;
    use super::*;

    #[test]
    fn each_task_is_a_part_of_a_page_that_leads_nowhere() {
        for lesson in &LESSONS {
            for document in [lesson.document.0, lesson.document.1] {
                let html = html(document);
                assert!(html.starts_with("<h1>"), "{html}");
                assert!(html.contains("<details>") && html.contains("<pre>"), "{html}");
                for other in ["href", "<script", "Solution", "Lösung", "txt simulate", "txt check"]
                {
                    assert!(!html.contains(other), "{}: {other}: {html}", lesson.number);
                }
            }
        }
    }
}
