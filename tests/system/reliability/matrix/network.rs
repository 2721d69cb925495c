//! A network that loses packets, in network namespaces, which only root can make.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, SystemTime};

use super::child::Child;
use super::row::{By, Outcome, Row, Seen, Skipped, Turn};
use super::system;

const SECTION: &str = "The network (in namespaces; default limits: read 2 s, idle 5 s)";

/// The controller's address. Namespaces are separate, so all networks use the same one.
const CONTROLLER: &str = "10.213.2.2";
const PORT: u16 = 65_000;

pub(crate) fn rows() -> Vec<Row> {
    let cut = |place, seconds, read_ms| {
        let length = Duration::from_secs(seconds);
        Row::new(SECTION, "network cut", place).test(move || cut(length, read_ms))
    };
    let reconnects_after = |place, seconds| {
        let length = Duration::from_secs(seconds);
        Row::new(SECTION, "network cut", place).test(move || reconnects_after(length))
    };
    const READ: &str = "the read limit (2 s) and 0.5 s";
    let rows = [
        cut("for 12 s", 12, 2000).sees("`NoAnswer`", READ).by(&[By::Board]),
        // The last packets may arrive when the network is back.
        cut("for 3 s", 3, 2000).sees("`NoAnswer`", READ).by(&[By::Exchange, By::Board]),
        cut("for 1 s, with a read limit of 4 s", 1, 4000).sees("nothing: TCP sends again", "–"),
        reconnects_after("for 12 s, with reconnecting", 12)
            .sees("`ConnectionLost` once, and it goes on", READ)
            .by(&[By::Board]),
        reconnects_after("for 3 s, with reconnecting", 3)
            .sees("`ConnectionLost` once, and it goes on", READ)
            .by(&[By::Exchange, By::Board]),
        reconnects_after("for 1 s, with reconnecting", 1)
            .sees("nothing, or `ConnectionLost` once, and it goes on", READ)
            .by(&[By::GoesOn, By::Exchange, By::Board]),
        Row::new(SECTION, "5 % loss", "both ways, for 5 s, with a read limit of 10 s")
            .sees("nothing: TCP sends again", "–")
            .test(loss),
        Row::new(SECTION, "network cut", "`begin_transfer`")
            .sees("`ConnectTimedOut`", "the connect limit (1 s)")
            .by(&[By::NeverOn])
            .test(|| begin_in_vain(CONTROLLER)),
        Row::new(SECTION, "silent name servers", "`begin_transfer` by a name")
            .sees("`LookupTimedOut`", "the connect limit (1 s)")
            .by(&[By::NeverOn])
            .test(|| begin_in_vain("txt.example.org")),
    ];
    rows.into_iter().map(|row| row.turn(Turn::First)).collect()
}

/// The namespaces of the program, the router and the controller.
struct Network {
    program: String,
    router: String,
    controller: String,
}

impl Network {
    fn new() -> Result<Self, Skipped> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        system::only_unix("network namespaces")?;
        if !system::is_root() {
            return Err(Skipped("it needs root".to_owned()));
        }
        for tool in ["ip", "tc"] {
            let help = Command::new(tool).arg("-V").stdout(Stdio::null()).status();
            help.map_err(|error| Skipped(format!("{tool} does not run: {error}")))?;
        }
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = |end| format!("reliability-{}-{number}-{end}", std::process::id());
        let network = Self { program: name("p"), router: name("r"), controller: name("c") };
        network.set_up().map_err(|error| Skipped(format!("no network can be made: {error}")))?;
        Ok(network)
    }

    fn set_up(&self) -> Result<(), String> {
        let Self { program, router, controller } = self;
        for name in [program, router, controller] {
            run(&format!("ip netns add {name}"))?;
            run(&format!("ip -n {name} link set lo up"))?;
        }
        for (net, name) in [(1, program), (2, controller)] {
            run(&format!("ip -n {name} link add far type veth peer name net{net} netns {router}"))?;
            run(&format!("ip -n {name} addr add 10.213.{net}.2/24 dev far"))?;
            run(&format!("ip -n {name} link set far up"))?;
            run(&format!("ip -n {router} addr add 10.213.{net}.1/24 dev net{net}"))?;
            run(&format!("ip -n {router} link set net{net} up"))?;
            run(&format!("ip -n {name} route add default via 10.213.{net}.1"))?;
        }
        run(&format!("ip netns exec {router} sysctl -qw net.ipv4.ip_forward=1"))?;
        // Host names are asked from servers behind this network.
        fs::create_dir_all(self.name_servers())
            .and_then(|()| {
                let servers = format!("nameserver {CONTROLLER}\n").repeat(3);
                fs::write(self.name_servers().join("resolv.conf"), servers)
            })
            .map_err(|error| error.to_string())
    }

    /// The folder that `ip netns exec` mounts over /etc.
    fn name_servers(&self) -> PathBuf {
        Path::new("/etc/netns").join(&self.program)
    }

    /// Silently drops all packets from now on, in both directions.
    fn cut(&self) -> Result<(), Skipped> {
        self.at_both_ends("qdisc replace dev", "root pfifo limit 0")
    }

    fn restore(&self) -> Result<(), Skipped> {
        self.at_both_ends("qdisc del dev", "root")
    }

    fn at_both_ends(&self, before: &str, after: &str) -> Result<(), Skipped> {
        for end in ["net1", "net2"] {
            run(&format!("tc -n {} {before} {end} {after}", self.router)).map_err(Skipped)?;
        }
        Ok(())
    }

    /// Loses 5 packets of 100, with netem or iptables.
    fn lose(&self) -> Result<(), Skipped> {
        self.at_both_ends("qdisc replace dev", "root netem loss 5%").or_else(|_| {
            let rule = "-A FORWARD -m statistic --mode random --probability 0.05 -j DROP";
            run(&format!("ip netns exec {} iptables {rule}", self.router))
                .map(drop)
                .map_err(|error| Skipped(format!("neither netem nor iptables works: {error}")))
        })
    }

    /// How many packets both sides have sent again.
    fn sent_again(&self) -> u64 {
        let count = |namespace: &String| {
            let shown = run(&format!("ip netns exec {namespace} cat /proc/net/snmp")).unwrap();
            let tcp: Vec<&str> = shown.lines().filter(|line| line.starts_with("Tcp:")).collect();
            let names = tcp[0].split_whitespace();
            let values = tcp[1].split_whitespace();
            let found = names.zip(values).find(|(name, _)| *name == "RetransSegs").unwrap();
            found.1.parse::<u64>().unwrap()
        };
        count(&self.program) + count(&self.controller)
    }

    fn start(&self, namespace: &str, role: &str) -> Child {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", namespace]).arg(std::env::current_exe().unwrap());
        Child::start_by(command, role)
    }

    /// A controller and a program with a motor on.
    fn pair(&self, role: &str) -> [Child; 2] {
        let mut controller = self.start(&self.controller, &format!("controller {PORT}"));
        controller.hear("listens");
        let mut program = self.start(&self.program, role);
        program.hear("begun");
        [controller, program]
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        for name in [&self.program, &self.router, &self.controller] {
            let _ = run(&format!("ip netns del {name}"));
        }
        let _ = fs::remove_dir_all(self.name_servers());
    }
}

/// Removes the networks of this process, which a test that hangs does not remove, and those of
/// processes that were killed.
pub(crate) fn clean_up() {
    let shown = run("ip netns list").unwrap_or_default();
    for name in shown.lines().filter_map(|line| line.split_whitespace().next()) {
        let process = name.strip_prefix("reliability-").and_then(|rest| rest.split('-').next());
        let is_left = process.is_some_and(|process| {
            process == std::process::id().to_string() || !Path::new("/proc").join(process).exists()
        });
        if is_left {
            let _ = run(&format!("ip netns del {name}"));
            let _ = fs::remove_dir_all(Path::new("/etc/netns").join(name));
        }
    }
    // This works only when it is empty.
    let _ = fs::remove_dir("/etc/netns");
}

/// Runs a command and returns its output.
fn run(command: &str) -> Result<String, String> {
    let mut words = command.split_whitespace();
    let output = Command::new(words.next().unwrap_or_default()).args(words).output();
    let output = output.map_err(|error| format!("{command}: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{command}: {}", String::from_utf8_lossy(&output.stderr).trim())),
    }
}

fn cut(length: Duration, read_ms: u64) -> Result<Outcome, Skipped> {
    let network = Network::new()?;
    let [mut controller, mut program] =
        network.pair(&format!("program {CONTROLLER} {PORT} {read_ms}"));
    let struck = SystemTime::now();
    network.cut()?;
    thread::sleep(length);
    network.restore()?;
    finish(&network, struck, &mut controller, &mut program)
}

fn loss() -> Result<Outcome, Skipped> {
    let network = Network::new()?;
    let [mut controller, mut program] = network.pair(&format!("program {CONTROLLER} {PORT} 10000"));
    network.lose()?;
    thread::sleep(Duration::from_secs(5));
    finish(&network, SystemTime::now(), &mut controller, &mut program)
}

/// Lets the program go on for a while, ends it, and asks both processes for their result.
fn finish(
    network: &Network,
    struck: SystemTime,
    controller: &mut Child,
    program: &mut Child,
) -> Result<Outcome, Skipped> {
    thread::sleep(Duration::from_secs(2));
    drop(program.stdin.take());
    let (ended, ended_at) = program.hear("ended");
    let (by, off_at) = controller.hear("off");
    assert!(network.sent_again() > 0, "no packet was lost");
    let since = |when: SystemTime| when.duration_since(struck).ok();
    if ended == "Ok" {
        // The program has ended the transfer itself.
        assert_eq!(by, "Exchange");
        return Ok(Outcome { seen: Seen::Nothing, soon: None, by: By::GoesOn, stopped: None });
    }
    let (soon, stopped) = (since(ended_at), since(off_at));
    Ok(Outcome { seen: Seen::Named(ended), soon, by: by_name(&by), stopped })
}

fn by_name(name: &str) -> By {
    match name {
        "Exchange" => By::Exchange,
        _ => By::Board,
    }
}

/// Cuts the network for a while, and lets the program go on when it is connected again.
fn reconnects_after(length: Duration) -> Result<Outcome, Skipped> {
    let network = Network::new()?;
    let [mut controller, mut program] = network.pair(&format!("reconnecting {CONTROLLER} {PORT}"));
    let struck = SystemTime::now();
    network.cut()?;
    thread::sleep(length);
    network.restore()?;
    // The program may notice this late that the network is back.
    thread::sleep(Duration::from_secs(4));
    drop(program.stdin.take());
    let (reported, told_at) = program.hear("reported");
    let (ended, _) = program.hear("ended");
    assert_eq!(ended, "Ok");
    let (by, off_at) = controller.hear("off");
    if reported == "nothing" {
        return Ok(Outcome { seen: Seen::Nothing, soon: None, by: By::GoesOn, stopped: None });
    }
    let since = |when: SystemTime| when.duration_since(struck).ok();
    let (soon, stopped) = (since(told_at), since(off_at));
    Ok(Outcome { seen: Seen::Named(reported), soon, by: by_name(&by), stopped })
}

/// Begins a transfer with a controller that is cut off.
fn begin_in_vain(host: &str) -> Result<Outcome, Skipped> {
    let network = Network::new()?;
    network.cut()?;
    let mut program = network.start(&network.program, &format!("begin {host} {PORT}"));
    let (_, begins) = program.hear("begins");
    let (name, begun) = program.hear("begun");
    let soon = begun.duration_since(begins).unwrap_or_default();
    Ok(Outcome { seen: Seen::Named(name), soon: Some(soon), by: By::NeverOn, stopped: None })
}
