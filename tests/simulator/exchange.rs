//! What the simulated TXT answers.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};
use ft_transfer_area::wire::{CommandId, ExchangeData, QueryStatusResponse, ResponseId};
use ft_transfer_area::FirmwareVersion;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::unpaced;
use crate::wire_client::Client;

/// M1 forward at full speed: two pulses per exchange.
fn m1_forward() -> ExchangeData {
    let mut outputs = ExchangeData::default();
    outputs.duty[0] = 512;
    outputs
}

#[test]
fn the_handshake_is_answered() {
    let version = FirmwareVersion::new(4, 1, 6);
    let builder = unpaced().firmware(version).device_name("a name longer than 16 bytes");
    let txt = builder.start().unwrap();
    assert!(txt.address().ip().is_loopback());
    let mut client = Client::connect(&txt);
    client.command(CommandId::QueryStatus);
    let status = QueryStatusResponse::parse(&client.receive(QueryStatusResponse::LEN)).unwrap();
    assert_eq!((status.name().as_str(), status.version), ("a name longer th", version));

    client.start_online();
    let mut config = Config::default();
    config.uni[7] = UniConfig::analog(InputMode::Ultrasonic);
    client.update_config(1, 0, config);
    client.update_config(1, 8, Config::default());
    txt.with_machine(|machine| {
        assert!(machine.connected() && machine.online());
        assert_eq!((machine.connections(), machine.exchanges()), (1, 0));
        assert_eq!((machine.controllers[0].config, machine.controllers[0].config_id), (config, 1));
        let [query, start, update] =
            [CommandId::QueryStatus, CommandId::StartOnline, CommandId::UpdateConfig];
        assert!(machine.commands().eq([query, start, update, update]));
    });

    client.command(CommandId::StopOnline);
    ResponseId::StopOnline.check(&client.receive(4)).unwrap();
    assert!(txt.with_machine(|machine| machine.connected() && !machine.online()));
}

#[test]
fn an_unchanged_config_id_is_ignored() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    let changed = Config { motor: [0; 4].into(), ..Config::default() };
    client.update_config(5, 0, Config::default());
    client.update_config(5, 0, changed);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config), Config::default());
    client.update_config(6, 0, changed);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config), changed);
}

#[test]
fn the_simple_exchange_carries_the_masters_values() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    txt.with_machine(|machine| {
        machine.controllers[0].uni = [1, 2, 3, 4, 5, 6, 7, -8];
        machine.controllers[0].ir[4].left_x = -15;
    });
    let response = client.exchange(&m1_forward());
    assert_eq!(response.uni, [1, 2, 3, 4, 5, 6, 7, -8]);
    assert_eq!(response.ir[4].left_x, -15);
    assert_eq!(response.counter, [2, 0, 0, 0]);
    txt.with_machine(|machine| {
        assert_eq!(machine.controllers[0].outputs, m1_forward());
        assert_eq!(machine.exchanges(), 1);
    });
}

#[test]
fn extensions_come_and_go() {
    let txt = unpaced().extensions(2).start().unwrap();
    let mut client = Client::online(&txt);
    txt.with_machine(|machine| {
        for (area, controller) in (1..).zip(&mut machine.controllers) {
            controller.uni[0] = 100 * area;
        }
    });
    let inputs = client.exchange_compressed(&[[0; 27]], 0);
    assert_eq!(inputs.mask, 0b11);
    assert_eq!([0, 52, 104].map(|at| inputs.words[at]), [100, 200, 300]);

    txt.with_machine(|machine| machine.alive[0] = false);
    let inputs = client.exchange_compressed(&[[1; 27], [2; 27], [3; 27]], 0b11);
    assert_eq!(inputs.mask, 0b10);
    assert_eq!([0, 52].map(|at| inputs.words[at]), [100, 300]);
    let sounds = txt.with_machine(|machine| {
        [0, 1, 2].map(|area: usize| machine.controllers[area].outputs.sound_index)
    });
    assert_eq!(sounds, [1, 0, 3]);
}

#[test]
fn exchange_responses_keep_the_pace() {
    let pace = Duration::from_millis(20);
    let txt = SimulatedTxt::builder().pace(pace).start().unwrap();
    let mut client = Client::online(&txt);
    let begin = Instant::now();
    client.exchange(&m1_forward());
    for exchange in 1..=5 {
        client.exchange(&m1_forward());
        assert!(begin.elapsed() >= pace * exchange, "exchange {exchange} came too early");
    }
}

#[test]
fn a_distance_ends_and_its_id_comes_back_then() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    let mut outputs = m1_forward();
    client.exchange(&outputs);
    outputs.motor_command_id[0] = 7;
    outputs.distance[0] = 9;
    for counter in [2, 4, 6, 8] {
        let response = client.exchange(&outputs);
        assert_eq!((response.counter[0], response.motor_command_id[0]), (counter, 0));
    }
    for _ in 0..3 {
        let response = client.exchange(&outputs);
        assert_eq!((response.counter[0], response.motor_command_id[0]), (9, 7));
    }
}

#[test]
fn a_counter_reset_comes_back_at_once_in_the_simple_exchange_and_one_later_in_the_compressed() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    txt.with_machine(|machine| machine.controllers[0].counter[2] = 77);
    let mut outputs = ExchangeData::default();
    assert_eq!(client.exchange(&outputs).counter[2], 77);
    outputs.counter_reset_id[2] = 3;
    let response = client.exchange(&outputs);
    assert_eq!((response.counter[2], response.counter_reset_id[2]), (0, 3));

    let mut words = [0; 27];
    words[22] = 4;
    let finished = [(); 2].map(|()| client.exchange_compressed(&[words], 0).words[18]);
    assert_eq!(finished, [3, 4]);
}

#[test]
fn a_sound_takes_the_time_of_its_file_for_each_repeat() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    let outputs = ExchangeData {
        sound_command_id: 4,
        sound_index: 29,
        sound_repeat: 2,
        ..ExchangeData::default()
    };
    // Two times 864 ms.
    for _ in 0..172 {
        assert_eq!(client.exchange(&outputs).sound_command_id, 0);
    }
    let playing = || txt.with_machine(|machine| machine.controllers[0].playing_sound());
    assert_eq!(playing(), Some(4));
    assert_eq!(client.exchange(&outputs).sound_command_id, 4);
    assert_eq!(playing(), None);
}

#[test]
fn a_script_sets_the_inputs_of_the_same_exchange() {
    let script = |machine: &mut Machine| {
        let answered = i16::try_from(machine.exchanges()).unwrap();
        let master = &mut machine.controllers[0];
        master.uni[0] = master.outputs.duty[0] + answered;
        master.counter[0] = -1;
    };
    let txt = unpaced().on_exchange(script).start().unwrap();
    let mut client = Client::online(&txt);
    for answered in 0..3 {
        let response = client.exchange(&m1_forward());
        assert_eq!((response.uni[0], response.counter[0]), (512 + answered, -1));
    }
}
