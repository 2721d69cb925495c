//! The tables of `docs/c_functions.md`: every function of the headers is in them, and says what it does here.

use std::collections::BTreeSet;
use std::fs;

/// How each row says what a call does.
const ANSWERS: [&str; 3] = ["as on the TX", "different: ", "not available: "];

fn read(path: &str) -> String {
    let path = format!("{}/../{path}", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    text.replace("\r\n", "\n")
}

/// The names in the table below a heading, in order. A row has one or more names, and one of the three answers.
fn table(heading: &str) -> Vec<String> {
    let document = read("docs/c_functions.md");
    let (_, rest) = document.split_once(&format!("\n{heading}\n")).expect("the heading");
    let rows = rest.lines().take_while(|line| !line.starts_with('#'));
    let rows = rows.filter_map(|line| line.strip_prefix("| `"));
    rows.flat_map(|row| {
        let (names, answer) = row.split_once("` | ").expect("two columns");
        assert!(ANSWERS.iter().any(|known| answer.starts_with(known)), "{names}: {answer}");
        names.split("`, `").map(str::to_owned)
    })
    .collect()
}

/// A header without its comments and lines for the preprocessor.
fn code(path: &str) -> String {
    let header = read(path).replace("\\\n", " ");
    let mut code = String::new();
    let mut rest = header.as_str();
    while let Some((before, comment)) = rest.split_once("/*") {
        code += before;
        rest = comment.split_once("*/").expect("the end of a comment").1;
    }
    code += rest;
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n")
}

/// The word at the end of a text.
fn last_word(text: &str) -> &str {
    let text = text.trim_end();
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.rsplit(|c| !is_part(c)).next().unwrap_or_default()
}

/// The functions that a header declares or defines: what is between braces is left out, except for that
/// between those of `extern "C"`.
fn functions(code: &str) -> Vec<String> {
    let code = code.replace("extern \"C\" {", "").replace("extern \"C\"\n{", "");
    let mut outside = String::new();
    let mut depth = 0_i32;
    for c in code.chars() {
        match c {
            '{' => depth += 1,
            // The surplus brace is the one of `extern "C"`.
            '}' => {
                depth = (depth - 1).max(0);
                outside.push(';');
            }
            c if depth == 0 => outside.push(c),
            _ => {}
        }
    }
    let declarations = outside.split(';').map(str::trim);
    let declarations = declarations.filter(|text| !text.starts_with("typedef"));
    declarations
        .filter_map(|text| text.split_once('('))
        .map(|(before, _)| last_word(before).to_owned())
        .collect()
}

/// What is public in a class.
fn public_calls(code: &str, class: &str) -> BTreeSet<String> {
    let begin = code
        .match_indices(&format!("class {class}"))
        .map(|(at, found)| &code[at + found.len()..])
        .find(|rest| rest.trim_start().starts_with(['{', ':', 'f']))
        .expect("the class");
    let (_, body) = begin.split_once('{').expect("its body");
    let mut depth = 1;
    let end = body.find(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0
    });
    let body = &body[..end.expect("its end")];
    let parts = body.split("public:").skip(1);
    let parts = parts.map(|part| part.split("private:").next().unwrap_or_default());
    let parts = parts.map(|part| part.split("protected:").next().unwrap_or_default());
    parts.flat_map(functions).collect()
}

/// The headers with what programs use of Windows.
const OF_WINDOWS: [&str; 10] = [
    "ft_windows_c.h",
    "ft_scanf_s.h",
    "windows.h",
    "wincon.h",
    "winuser.h",
    "mmsystem.h",
    "process.h",
    "io.h",
    "direct.h",
    "strsafe.h",
];

#[test]
fn every_function_of_windows_is_in_its_table() {
    let document = read("docs/c_programs.md");
    let (_, rest) = document.split_once("\n## What there is of Windows\n").expect("the heading");
    let (table, _) = rest.split_once("\n## ").expect("the next heading");
    let has = |name: &str| table.contains(&format!("`{name}`"));
    let mut count = 0;
    for header in OF_WINDOWS {
        let names = functions(&code(&format!("c/include/posix/{header}")));
        // Neither those of our own nor those that hide from macros of the C library.
        let is_public = |name: &String| !name.to_lowercase().starts_with("ft_") && name.len() > 3;
        for name in names.into_iter().filter(is_public) {
            // Functions for two kinds of texts have one name.
            let short = name.strip_suffix(['A', 'W']);
            assert!(has(&name) || short.is_some_and(has), "{name} of {header}");
            count += 1;
        }
    }
    assert!(count > 100, "{count}");
}

fn set(names: Vec<String>) -> BTreeSet<String> {
    let count = names.len();
    let names: BTreeSet<String> = names.into_iter().collect();
    assert_eq!(names.len(), count, "a name comes twice: {names:?}");
    names
}

#[test]
fn every_hook_is_in_the_table_in_order() {
    let code = code("c/include/ROBO_TX_FW.h");
    let (before, _) = code.split_once("} TA_HOOK_TABLE").expect("the table of hooks");
    let (_, members) = before.rsplit_once('{').expect("its members");
    let hooks: Vec<&str> = members
        .split(';')
        .filter_map(|member| member.split_once("(*"))
        .map(|(_, rest)| rest.split(')').next().unwrap_or_default())
        .collect();
    assert_eq!(hooks.len(), 36);
    assert_eq!(table("## Every hook"), hooks);
}

#[test]
fn every_function_of_the_pc_library_is_in_the_table_in_order() {
    let functions = functions(&code("c/include/ftMscLib.h"));
    assert_eq!(functions.len(), 82);
    assert_eq!(table("## Every function of ftMscLib"), functions);
}

#[test]
fn every_function_of_the_variant_is_in_the_table_in_order() {
    let functions = functions(&code("c/include/ftMscLibEx.h"));
    assert_eq!(functions.len(), 28);
    assert_eq!(table("### Every function of ftMscLibEx"), functions);
}

#[test]
fn every_function_of_kelib_is_in_the_table() {
    let functions = set(functions(&code("c/include/txt/KeLibTxtDl.h")));
    assert_eq!(functions.len(), 7, "{functions:?}");
    assert_eq!(set(table("## Every function of KeLib")), functions);
}

#[test]
fn every_call_of_the_kits_class_is_in_the_table() {
    let header = code("c/include/kit/ftProInterface2013TransferAreaCom.h");
    let calls = public_calls(&header, "ftIF2013TransferAreaComHandler");
    assert_eq!(set(table("### The kits 4.1.6 and 4.6.6: `ftIF2013TransferAreaComHandler`")), calls);
    let calls = public_calls(&header, "ftIF2013TransferAreaComHandlerEx");
    assert_eq!(set(table("### The kit 4.6.6: `ftIF2013TransferAreaComHandlerEx`")), calls);
}

#[test]
fn every_call_of_fttxtlib_is_in_the_table() {
    let base = code("c/include/fttxtlib/ftProInterface2013TransferAreaCom.h");
    let own = code("c/include/fttxtlib/ftProInterface2013TransferAreaComEx2.h");
    let classes = [
        (&base, "ftIF2013TransferAreaComHandler"),
        (&base, "ftIF2013TransferAreaComHandlerEx1"),
        (&own, "ftIF2013TransferAreaComHandlerEx2"),
    ];
    // Constructors of the classes below are not public.
    let calls = classes.iter().flat_map(|(header, class)| public_calls(header, class)).collect();
    assert_eq!(set(table("### FtTxtLib: `ftIF2013TransferAreaComHandlerEx2`")), calls);
}
