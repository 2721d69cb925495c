//! Random programs of public calls, and a specification that judges what they and the controllers saw.

mod areas;
mod batch;
mod child;
mod hook;
mod logger;
mod machine;
mod name;
mod options;
mod plan;
mod program;
mod record;
mod run;
mod shrink;
mod spec;
mod stalls;
mod strategy;
mod timeline;
mod work;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};

use options::Options;

/// How many programs the tests run.
const IN_TESTS: u64 = 300;

pub(crate) fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if args.first().is_some_and(|arg| arg == batch::CHILD) {
        child::main(args.iter().any(|arg| arg == batch::BLOCKS));
        return ExitCode::SUCCESS;
    }
    match Options::parse(&args) {
        Ok(Some(options)) => return work::for_hours(&options),
        Ok(None) => {}
        Err(mistake) => {
            eprintln!("{mistake}");
            return ExitCode::FAILURE;
        }
    }
    let test = || work::in_tests(IN_TESTS).map_err(Into::into);
    let trial = Trial::test("random_programs_keep_what_the_documents_promise", test);
    libtest_mimic::run(&Arguments::from_args(), vec![trial]).exit_code()
}
