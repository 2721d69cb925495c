// What the stations of the factory have in common: the controller, its inputs and outputs, axes, and the messages
// between the stations.
//
// Each station is a program of its own with a controller of its own. Several axes of a station move at once, each in
// a thread. Everything looks after each exchange with the controller. There is one each 10 ms, and pauses are counted
// in exchanges: they follow the controller's time. The stations talk over an MQTT broker; a state is retained, so a
// station that starts later knows it at once.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <mosquitto.h>

#include "FtShmem.h"
#include "KeLibTxtDl.h"

namespace factory {

const INT16 FULL = 512;
const int EXCHANGE_MS = 10;
const int LONGEST_MOVE_S = 20;

// The exchanges with the controller so far, which are counted in the library's thread.
struct Exchanges {
    std::mutex mutex;
    std::condition_variable changed;
    long count = 0;
    // Threads that drive something, and those of them that wait for the next exchange.
    int drive = 1;
    int wait = 0;
};

inline Exchanges &exchanges()
{
    static Exchanges all;
    return all;
}

// The next exchange waits until all have looked at this one, also on a busy computer: a motor stops where its switch is.
inline bool count_exchange(FISH_X1_TRANSFER *, int)
{
    Exchanges &all = exchanges();
    std::unique_lock<std::mutex> lock(all.mutex);
    all.count++;
    all.wait = 0;
    all.changed.notify_all();
    all.changed.wait_for(lock, std::chrono::milliseconds(100), [&] { return all.wait >= all.drive; });
    return true;
}

// Ends early, with an error, when there are no more exchanges.
inline void pause(int ms = EXCHANGE_MS)
{
    Exchanges &all = exchanges();
    std::unique_lock<std::mutex> lock(all.mutex);
    const long end = all.count + ms / EXCHANGE_MS;
    while (all.count < end) {
        const long seen = all.count;
        all.wait++;
        all.changed.notify_all();
        while (all.count == seen) {
            if (!MotorIOLib_ThreadIsRunning())
                throw std::runtime_error("the controller has gone");
            all.changed.wait_for(lock, std::chrono::milliseconds(100));
        }
    }
}

// Looks after each exchange until it is done.
template <class Done> void wait_for(const std::string &what, int seconds, Done done)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
    while (!done()) {
        if (std::chrono::steady_clock::now() > end)
            throw std::runtime_error(what + ": it takes more than " + std::to_string(seconds) + " s");
        pause();
    }
}

// The controller, from the beginning of the program to its end.
class Controller {
public:
    Controller()
    {
        SetTransferAreaCompleteCallback(count_exchange);
        if (StartTxtDownloadProg() != KELIB_ERROR_NONE)
            throw std::runtime_error("the controller does not answer");
    }
    ~Controller() { StopTxtDownloadProg(); }
    Controller(const Controller &) = delete;
    Controller &operator=(const Controller &) = delete;

    // 0 is the master, 1 the first extension.
    FISH_X1_TRANSFER &area(int index) { return GetKeLibTransferAreaMainAddress()[index]; }
};

// A switch, or a light barrier. I1 has the number 1.
class Switch {
public:
    Switch(FISH_X1_TRANSFER &area, int number) : area(&area), index(number - 1)
    {
        area.ftX1config.uni[index].mode = MODE_R;
        area.ftX1config.uni[index].digital = true;
        area.ftX1state.config_id++;
        // Until then the input has the voltage from before.
        pause(3 * EXCHANGE_MS);
    }

    bool is_closed() const { return area->ftX1in.uni[index] == 1; }
    // There is no light while something is in the way.
    bool is_interrupted() const { return !is_closed(); }

private:
    FISH_X1_TRANSFER *area;
    int index;
};

// A lamp, a valve or the compressor. O1 has the number 1.
class Output {
public:
    Output(FISH_X1_TRANSFER &area, int number) : area(&area), index(number - 1) {}

    void set(bool on) { area->ftX1out.duty[index] = on ? FULL : 0; }
    void pulse(int ms)
    {
        set(true);
        pause(ms);
        set(false);
    }

private:
    FISH_X1_TRANSFER *area;
    int index;
};

// A motor. M1 has the number 1.
class Drive {
public:
    Drive(FISH_X1_TRANSFER &area, int number) : area(&area), motor(number - 1) {}

    void left() { set(FULL, 0); }
    void right() { set(0, FULL); }
    void stop() { set(0, 0); }

protected:
    void set(INT16 one, INT16 other)
    {
        area->ftX1out.duty[2 * motor] = one;
        area->ftX1out.duty[2 * motor + 1] = other;
    }

    FISH_X1_TRANSFER *area;
    int motor;
};

// An axis between switches, such as a turntable.
class SwitchAxis : public Drive {
public:
    using Drive::Drive;

    void left_to(const Switch &end)
    {
        left();
        wait_for("an axis moves left", LONGEST_MOVE_S, [&] { return end.is_closed(); });
        stop();
    }
    void right_to(const Switch &end)
    {
        right();
        wait_for("an axis moves right", LONGEST_MOVE_S, [&] { return end.is_closed(); });
        stop();
    }
};

// An axis with an encoder and a reference switch. Its place is counted in pulses from there to the right.
class Axis : public Drive {
public:
    Axis(FISH_X1_TRANSFER &area, int number, int switch_number)
        : Drive(area, number), reference(area, switch_number)
    {
    }

    void find_reference()
    {
        command(0);
        left();
        wait_for("an axis looks for its reference", LONGEST_MOVE_S, [&] { return reference.is_closed(); });
        stop();
        place = 0;
    }

    void move_to(int wanted)
    {
        const int way = wanted - place;
        if (way == 0)
            return;
        command(std::abs(way));
        way > 0 ? right() : left();
        wait_for("an axis moves", LONGEST_MOVE_S, [&] {
            return area->ftX1in.motor_ex_cmd_id[motor] == area->ftX1out.motor_ex_cmd_id[motor];
        });
        stop();
        // It may have run on by a few pulses.
        const int run = area->ftX1in.counter[motor];
        place += way > 0 ? run : -run;
    }

private:
    void command(int distance)
    {
        area->ftX1out.distance[motor] = distance;
        area->ftX1out.motor_ex_cmd_id[motor]++;
    }

    Switch reference;
    int place = 0;
};

// Does several things at once, and waits for all of them.
template <class... Work> void together(Work... work)
{
    std::exception_ptr errors[sizeof...(work)] = {};
    int next = 0;
    // The last one that ends hands over to this thread, which joins them.
    int left = sizeof...(work);
    const auto end = [&] {
        const std::lock_guard<std::mutex> lock(exchanges().mutex);
        if (--left > 0)
            exchanges().drive--;
        exchanges().changed.notify_all();
    };
    const auto start = [&](auto one) {
        std::exception_ptr &error = errors[next++];
        return std::thread([one, end, &error] {
            try {
                one();
            } catch (...) {
                error = std::current_exception();
            }
            end();
        });
    };
    {
        const std::lock_guard<std::mutex> lock(exchanges().mutex);
        exchanges().drive += left - 1;
    }
    std::thread threads[] = {start(work)...};
    for (std::thread &thread : threads)
        thread.join();
    for (const std::exception_ptr &error : errors)
        if (error)
            std::rethrow_exception(error);
}

// The messages of a station: its state, which is retained, and those of others.
class Messages {
public:
    // The broker is named by FACTORY_BROKER, as in 127.0.0.1:1883.
    explicit Messages(const std::string &station) : topic("factory/" + station)
    {
        const char *named = std::getenv("FACTORY_BROKER");
        const std::string broker = named ? named : "127.0.0.1:1883";
        const size_t colon = broker.find(':');
        const int port = colon == std::string::npos ? 1883 : std::stoi(broker.substr(colon + 1));
        mosquitto_lib_init();
        client = mosquitto_new(nullptr, true, this);
        mosquitto_message_callback_set(client, receive);
        mosquitto_connect_callback_set(client, [](mosquitto *client, void *, int) {
            mosquitto_subscribe(client, nullptr, "factory/#", 1);
        });
        if (mosquitto_connect(client, broker.substr(0, colon).c_str(), port, 10) != MOSQ_ERR_SUCCESS)
            throw std::runtime_error("there is no MQTT broker at " + broker);
        mosquitto_loop_start(client);
    }
    ~Messages()
    {
        mosquitto_disconnect(client);
        mosquitto_loop_stop(client, false);
        mosquitto_destroy(client);
        mosquitto_lib_cleanup();
    }
    Messages(const Messages &) = delete;
    Messages &operator=(const Messages &) = delete;

    void tell(const std::string &state)
    {
        std::printf("%s: %s\n", topic.c_str(), state.c_str());
        std::fflush(stdout);
        mosquitto_publish(client, nullptr, topic.c_str(), int(state.size()), state.data(), 1, true);
    }

    // What another station published last; empty if it has published nothing.
    std::string state_of(const std::string &station)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        return states["factory/" + station];
    }

    // How often another station has published this.
    int times_told(const std::string &station, const std::string &state)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        return told[{"factory/" + station, state}];
    }

private:
    static void receive(mosquitto *, void *self, const mosquitto_message *message)
    {
        Messages &messages = *static_cast<Messages *>(self);
        const std::lock_guard<std::mutex> lock(messages.mutex);
        const std::string topic = message->topic;
        if (topic.size() > LONGEST || size_t(message->payloadlen) > LONGEST)
            return;
        const std::string state(static_cast<char *>(message->payload), message->payloadlen);
        if (messages.told.size() >= MOST && messages.told.count({topic, state}) == 0)
            return;
        messages.states[topic] = state;
        messages.told[{topic, state}]++;
    }

    // Stations say a few different things, each in a few words. What others publish does not fill the memory.
    static const size_t LONGEST = 100;
    static const size_t MOST = 1000;

    std::string topic;
    mosquitto *client;
    std::mutex mutex;
    std::map<std::string, std::string> states;
    std::map<std::pair<std::string, std::string>, int> told;
};

// Runs a station until it ends or something goes wrong.
inline int run(const std::function<void()> &station)
{
    try {
        station();
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

} // namespace factory
