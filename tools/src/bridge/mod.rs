//! `txt bridge`: inputs as topics of an MQTT broker, and commands from it.

mod broker;
mod commands;
mod machine;
mod payload;
mod relay;
mod report;
#[cfg(test)]
mod samples;
mod topics;
mod value;
mod values;

use std::env;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{bail, ensure, Context};
use crossbeam_channel::{bounded, select};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area_simulator::SimulatedTxt;

use self::broker::Broker;
use self::machine::{handler, Machine};
use self::relay::Setup;
use self::topics::{is_prefix, level, Topics};
use self::values::Noise;
use crate::guardian::Guardian;
use crate::interrupt::{self, Driving};
use crate::names::{self, Names};
use crate::{arguments, lines, print};

/// The environment variable with the password for the broker: an argument could be read by everybody.
const PASSWORD: &str = "TXT_MQTT_PASSWORD";

/// Connect controllers to an MQTT broker: inputs as topics, and commands from topics
#[derive(clap::Args)]
#[command(after_help = "\
Example, with Mosquitto on this computer:
  txt bridge --mqtt 127.0.0.1 --simulate --name press
  mosquitto_sub -v -t 'ft/#'
  mosquitto_pub -t ft/press/M1/set -m '{\"duty\": 300}'
docs/bridge.md lists the topics.")]
pub(crate) struct Args {
    /// The broker: its host, or HOST:PORT; the usual port is 1883
    #[arg(long, value_name = "BROKER")]
    mqtt: String,
    /// The controllers; without one, the only one that is found
    #[arg(value_name = "HOST")]
    hosts: Vec<String>,
    /// Simulate a controller with this world instead
    #[arg(long, value_name = "WORLD", num_args = 0..=1, default_missing_value = "default")]
    #[arg(conflicts_with = "hosts")]
    simulate: Option<String>,
    /// The name in topics, once for each HOST in order; otherwise its address
    #[arg(long)]
    name: Vec<String>,
    #[command(flatten)]
    names: names::Files,
    /// How all topics begin
    #[arg(long, default_value = "ft")]
    prefix: String,
    /// The user at the broker; the password is in the variable TXT_MQTT_PASSWORD
    #[arg(long)]
    user: Option<String>,
    /// How many extensions each controller has
    #[arg(long, value_name = "N", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u8).range(0..=MAX_EXTENSIONS as i64))]
    extensions: u8,
    /// The shortest time between two messages about a measured value
    #[arg(long, value_name = "MS", default_value_t = 100)]
    #[arg(value_parser = clap::value_parser!(u64).range(0..=3_600_000))]
    every: u64,
    /// The smallest change of a measured value that is published
    #[arg(long, value_name = "UNITS", default_value_t = 1)]
    deadband: u16,
    /// Stop the motors after this time without a command or heartbeat; 0: never
    #[arg(long, value_name = "MS", default_value_t = 3000)]
    #[arg(value_parser = clap::value_parser!(u64).range(0..=3_600_000))]
    master_limit: u64,
    /// Stop the motors when the broker has been silent for this time
    #[arg(long, value_name = "MS", default_value_t = 4000)]
    #[arg(value_parser = clap::value_parser!(u64).range(2000..=60_000))]
    broker_limit: u64,
    /// Publish a motor with an encoder that should turn and stands still for this time; 0: never
    #[arg(long, value_name = "MS", default_value_t = 1000)]
    #[arg(value_parser = clap::value_parser!(u64).range(0..=3_600_000))]
    stall_limit: u64,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver_for_driving()?;
    lines::never_wait()?;
    let simulated = args.simulate.as_deref().map(arguments::simulated).transpose()?;
    let controllers = controllers(&args, simulated.as_ref())?;
    let names = args.names.read(controllers.len())?;
    let broker_limit = Duration::from_millis(args.broker_limit);
    let broker = Broker::new(&args.mqtt, login(args.user.clone())?, broker_limit)?;
    let (labels, hosts): (Vec<_>, Vec<_>) = controllers.iter().cloned().unzip();
    let stop = AtomicBool::new(false);
    let machines = controllers
        .into_iter()
        .zip(names)
        .map(|(controller, names)| machine(&args, &broker, controller, names, &stop))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // A simulated controller ends with this program.
    let guard = |host: &String| simulated.is_none().then(|| Guardian::start(host)).transpose();
    let guardians = hosts.iter().map(guard).collect::<anyhow::Result<Vec<_>>>()?;
    let _driving = Driving::begin();
    let done = thread::scope(|scope| {
        // One message of each machine.
        let (ended, ends) = bounded(machines.len());
        for ((machine, guardian), name) in machines.into_iter().zip(guardians).zip(labels) {
            let ended = ended.clone();
            let work = move || {
                let crashed = |_| bail!("the bridge has crashed, and its motors are stopped");
                let result = catch_unwind(AssertUnwindSafe(|| machine.run(guardian)));
                // It is received until the last one has ended.
                let _ = ended.send(result.unwrap_or_else(crashed).context(name));
            };
            let started = thread::Builder::new().spawn_scoped(scope, work);
            if let Err(error) = started {
                stop.store(true, Ordering::Relaxed);
                bail!("the operating system could not start a thread ({error})");
            }
        }
        drop(ended);
        let first = select! {
            recv(interrupted) -> _ => Ok(()),
            recv(ends) -> end => end.unwrap_or(Ok(())),
        };
        // One that fails ends all: a factory without one of its machines should not go on.
        stop.store(true, Ordering::Relaxed);
        let mut done = first;
        for end in &ends {
            match (&done, end) {
                (Ok(()), end) => done = end,
                // The first one is told at the end.
                (Err(_), Err(other)) => lines::print(&print::sentence(&other)),
                (Err(_), Ok(())) => {}
            }
        }
        done
    });
    done
}

fn machine<'a>(
    args: &Args,
    broker: &Broker,
    (name, host): (String, String),
    names: Names,
    stop: &'a AtomicBool,
) -> anyhow::Result<Machine<'a>> {
    let areas = 1 + usize::from(args.extensions);
    let handler = handler(&host, areas)?;
    let noise = Noise { every: Duration::from_millis(args.every), deadband: args.deadband };
    let limit = |millis| Some(Duration::from_millis(millis)).filter(|limit| !limit.is_zero());
    let setup = Setup {
        broker: broker.clone(),
        topics: Topics::new(&args.prefix, &name),
        name,
        host,
        names: names.by_topic(),
        noise,
        master_limit: limit(args.master_limit),
        stall_limit: limit(args.stall_limit),
    };
    Machine::new(handler, setup, stop)
}

/// The names and hosts of all controllers.
fn controllers(
    args: &Args,
    simulated: Option<&SimulatedTxt>,
) -> anyhow::Result<Vec<(String, String)>> {
    ensure!(
        is_prefix(&args.prefix),
        "the prefix {:?} can't begin a topic; write letters, digits, and / between levels",
        args.prefix
    );
    let hosts = match simulated {
        Some(txt) => vec![txt.address().to_string()],
        None if args.hosts.is_empty() => vec![arguments::found("auto")?],
        None => args.hosts.clone(),
    };
    ensure!(
        args.name.is_empty() || args.name.len() == hosts.len(),
        "there are {} controllers, but {} times --name; give each controller a name, or none",
        hosts.len(),
        args.name.len()
    );
    let given = if args.name.is_empty() { &hosts } else { &args.name };
    let names: Vec<String> = given.iter().map(|name| level(name)).collect();
    for (index, name) in names.iter().enumerate() {
        ensure!(
            !name.is_empty() && ![topics::STOP, topics::HEARTBEAT].contains(&name.as_str()),
            "{name:?} can't be the name of a controller"
        );
        // A prefix may be the topic of a controller, whose bridge removes what it does not publish.
        anyhow::ensure!(
            !topics::is_extension(name),
            "{name:?} can't be the name of a controller: extensions are called so"
        );
        ensure!(
            !names[..index].contains(name),
            "two controllers have the name {name:?}; give each another --name"
        );
    }
    let hosts = hosts.iter().map(|host| arguments::found(host));
    names.into_iter().zip(hosts).map(|(name, host)| Ok((name, host?))).collect()
}

fn login(user: Option<String>) -> anyhow::Result<Option<(String, String)>> {
    let Some(user) = user else { return Ok(None) };
    let password = env::var(PASSWORD)
        .with_context(|| format!("the password of {user} is missing in {PASSWORD}"))?;
    Ok(Some((user, password)))
}
