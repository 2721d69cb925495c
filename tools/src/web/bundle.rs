//! Makes one script of the page's modules, so that a browser asks once instead of once for each of them.
//!
//! A module becomes a function that returns what it exports. This needs no more of the language than the two forms that
//! the modules use: `import { a, b } from "./file.js";` on one line, and `export` before a `const`, a `class` or a
//! function. Everything else is refused, and a test puts all modules together.

use anyhow::{bail, ensure, Context};

/// One script of these modules, by name and text. Each comes after those that it imports.
pub(crate) fn bundle(modules: &[(&str, &str)]) -> anyhow::Result<String> {
    let mut script = String::from("const modules = {};\n");
    for (index, (name, text)) in modules.iter().enumerate() {
        let before: Vec<_> = modules[..index].iter().map(|(name, _)| *name).collect();
        script += &function(name, text, &before).with_context(|| (*name).to_owned())?;
    }
    Ok(script)
}

/// A module as a function that is called once. It may import from those before it.
fn function(name: &str, text: &str, before: &[&str]) -> anyhow::Result<String> {
    let mut exports = Vec::new();
    let mut body = String::new();
    for line in text.lines() {
        if line.starts_with("import") {
            let (names, from) = import(line).with_context(|| format!("{line:?} can't be read"))?;
            ensure!(before.contains(&from), "{from} does not come before it");
            body += &format!("const {{ {names} }} = modules[{from:?}];");
        } else if let Some(rest) = line.strip_prefix("export ") {
            exports.push(exported(rest).with_context(|| format!("{line:?} can't be read"))?);
            body += rest;
        } else {
            body += line;
        }
        body.push('\n');
    }
    for other in ["import(", "import.meta"] {
        if body.contains(other) {
            bail!("{other:?} is for modules that are loaded one by one");
        }
    }
    let exports = exports.join(", ");
    Ok(format!("modules[{name:?}] = (() => {{\n{body}return {{ {exports} }};\n}})();\n"))
}

/// The names that a line imports, and the file that has them.
fn import(line: &str) -> Option<(&str, &str)> {
    let (names, from) = line.strip_prefix("import { ")?.split_once(" } from \"./")?;
    let all_plain = names.split(", ").all(is_name);
    all_plain.then_some((names, from.strip_suffix("\";")?))
}

/// The name that a declaration gives.
fn exported(declaration: &str) -> Option<&str> {
    let rest = ["const ", "class ", "function ", "async function "]
        .iter()
        .find_map(|kind| declaration.strip_prefix(kind))?;
    let end = rest.find(|character| !is_part_of_name(character))?;
    Some(&rest[..end]).filter(|name| is_name(name))
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().all(is_part_of_name)
}

fn is_part_of_name(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_' || character == '$'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_becomes_a_function_that_returns_its_exports() {
        let first = "const inner = 1;\nexport const ONE = inner;\nexport class Two {}\n";
        let second = "import { ONE, Two } from \"./first.js\";\nexport function three() {}\n";
        assert_eq!(
            bundle(&[("first.js", first), ("second.js", second)]).unwrap(),
            "const modules = {};\n\
             modules[\"first.js\"] = (() => {\n\
             const inner = 1;\nconst ONE = inner;\nclass Two {}\n\
             return { ONE, Two };\n})();\n\
             modules[\"second.js\"] = (() => {\n\
             const { ONE, Two } = modules[\"first.js\"];\nfunction three() {}\n\
             return { three };\n})();\n"
        );
    }

    #[test]
    fn what_a_function_can_not_do_is_refused() {
        for text in [
            "import { one as two } from \"./first.js\";",
            "import * as all from \"./first.js\";",
            "import \"./first.js\";",
            "import { one } from \"./later.js\";",
            "import {\n  one,\n} from \"./first.js\";",
            "export default 1;",
            "export let changes = 1;",
            "export const { one, two } = three;",
            "export * from \"./first.js\";",
            "const later = import(\"./first.js\");",
        ] {
            assert!(bundle(&[("first.js", ""), ("second.js", text)]).is_err(), "{text}");
        }
    }
}
