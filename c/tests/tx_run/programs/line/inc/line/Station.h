#ifndef STATION_H
#define STATION_H

#include <atomic>
#include <thread>

#include <TxtHelpers.h>
#include "KeLibTxtDl.h"

namespace line {

/* A part of the line with a thread of its own. */
class Station
{
public:
    Station(const char *name, FISH_X1_TRANSFER *area) : name(name), area(area), ends(false) {}
    virtual ~Station() { stop(); }
    void start() { thread = std::thread([this] { run(); }); }
    void stop()
    {
        ends = true;
        if (thread.joinable()) thread.join();
    }
    void wait() { thread.join(); }
    const char *const name;

protected:
    virtual void run() = 0;
    FISH_X1_TRANSFER *area;
    std::atomic<bool> ends;

private:
    std::thread thread;
};

} // namespace line

#endif
