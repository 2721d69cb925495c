//! Constants, enumerations and error codes have their values, functions and hooks their types.

use std::fmt::Write;

use super::compilers;
use super::tables::{lines, CONSTANTS, ENUMERATIONS, ERRORS, EX_FUNCTIONS, FUNCTIONS, HOOKS};

/// A declaration that compiles only when the condition is true.
pub(crate) fn claim(name: &str, condition: &str) -> String {
    format!("extern char {name}[({condition}) ? 1 : -1];\n")
}

fn check(headers: &[&str], declarations: &str) {
    let headers: String = headers.iter().map(|header| format!("#include \"{header}\"\n")).collect();
    let source = format!("{headers}{declarations}int main(void) {{ return 0; }}\n");
    for compiler in compilers::all() {
        // A value is the same in those between.
        compiler.check_ends(&source);
    }
}

#[test]
fn constants_have_their_values() {
    for header in ["ROBO_TX_FW.h", "ROBO_TX_PRG.h", "ftMscLib.h"] {
        let of_header = lines::<3>(CONSTANTS).filter(|[place, ..]| *place == header);
        let claims: String = of_header
            .map(|[_, name, value]| claim(&format!("of_{name}"), &format!("{name} == {value}")))
            .collect();
        assert!(!claims.is_empty(), "{header}");
        check(&[header], &claims);
    }
}

#[test]
fn enumerations_have_their_values() {
    let mut text = String::new();
    let mut last = "";
    for [enumeration, name, value] in lines::<3>(ENUMERATIONS) {
        if enumeration != last {
            writeln!(text, "extern enum {enumeration} of_{enumeration};").unwrap();
            last = enumeration;
        }
        text += &claim(&format!("of_{name}"), &format!("(int) {name} == {value}"));
    }
    check(&["ROBO_TX_PRG.h"], &text);
}

/// Also those that an `int` or a `long` is compared with.
#[test]
fn error_codes_have_their_values() {
    let mut text = String::new();
    for [name, value] in lines::<2>(ERRORS) {
        text += &claim(
            &format!("of_{name}"),
            &format!("{name} == {value}U && {name} == (DWORD) {name}"),
        );
        text += &claim(&format!("as_int_{name}"), &format!("(int) {name} == (int) {value}U"));
        writeln!(text, "#if {name} != {value}\n#error {name}\n#endif").unwrap();
    }
    check(&["ftMscLib.h", "ftErrCode.h"], &text);
}

/// A pointer to a function takes exactly its type in C++, and nearly so in C.
#[test]
fn functions_have_their_types() {
    let tables = [("ftMscLib.h", FUNCTIONS, 82), ("ftMscLibEx.h", EX_FUNCTIONS, 28)];
    for (header, table, count) in tables {
        let mut text = String::new();
        let mut functions = 0;
        for [name, returns, parameters] in lines::<3>(table) {
            // In C++ these two take up the C++ linkage of the headers' functions.
            writeln!(text, "extern {returns} (*of_{name})({parameters});").unwrap();
            writeln!(text, "{returns} (*of_{name})({parameters}) = {name};").unwrap();
            functions += 1;
        }
        assert_eq!(functions, count);
        check(&[header], &text);
    }
}

/// In C as in C++, where it has a constructor.
#[test]
fn the_context_of_ex_is_laid_out_for_the_library() {
    let size = "sizeof(CB_LEVEL2) == (sizeof(void *) == 8 ? 24 : 16)";
    check(&["ftMscLibEx.h"], &claim("of_level_2", size));
}

#[test]
fn hooks_have_their_types_and_their_order() {
    let mut text = "#include <stddef.h>\nextern void take(TA_HOOK_TABLE *table);\n".to_owned();
    text += "void take(TA_HOOK_TABLE *table) {\n";
    let mut claims = claim("of_all", "sizeof(TA_HOOK_TABLE) == 36 * sizeof(void *)");
    for (index, [name, declaration]) in lines::<2>(HOOKS).enumerate() {
        let pointer = declaration.replacen(&format!("(*{name})"), "(**hook)", 1);
        assert_ne!(pointer, declaration, "{name}");
        writeln!(text, "    {{ {pointer} = &table->{name}; (void) hook; }}").unwrap();
        let place = format!("offsetof(TA_HOOK_TABLE, {name}) == {index} * sizeof(void *)");
        claims += &claim(&format!("of_{name}"), &place);
    }
    text += "}\n";
    assert_eq!(lines::<2>(HOOKS).count(), 36);
    check(&["ROBO_TX_FW.h"], &(text + &claims));
}
