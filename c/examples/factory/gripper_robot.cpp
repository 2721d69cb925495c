// Carries workpieces through the factory: from the delivery into the warehouse, from there to the oven, and from the
// sorting line to the pickup. It publishes over MQTT which container it wants from the warehouse, and waits for
// messages of the other stations.
#include "station.h"

unsigned int DebugFlags;
FILE *DebugFile;

using namespace factory;

namespace {

// In pulses from the reference switches; a larger vertical place is lower.
struct Place {
    int rotate, vertical, horizontal;
};

const Place DELIVERY = {22, 758, 19};
const Place COLOUR_SENSOR = {123, 645, 75};
const Place ABOVE_CONTAINER = {1410, 50, 186};
const Place IN_CONTAINER = {1410, 170, 186};
const Place OVEN = {931, 490, 934};
const Place PICKUP = {263, 320, 590};

struct Colour {
    const char *name;
    Place storage;
};

const Colour COLOURS[] = {
    {"white", {469, 845, 380}},
    {"red", {390, 845, 434}},
    {"blue", {316, 845, 588}},
};

class Robot {
public:
    explicit Robot(FISH_X1_TRANSFER &area)
        : area(area), rotate(area, 1, 1), vertical(area, 2, 2), horizontal(area, 3, 3), at_delivery(area, 7),
          compressor(area, 7), valve(area, 8)
    {
        area.ftX1config.uni[7].mode = MODE_U;
        area.ftX1config.uni[7].digital = false;
        area.ftX1config.cnt[3].mode = 1;
        area.ftX1state.config_id++;
    }

    void find_places()
    {
        vertical.find_reference();
        together([this] { rotate.find_reference(); }, [this] { horizontal.find_reference(); });
    }

    bool has_delivery() const { return at_delivery.is_interrupted(); }
    bool is_pickup_free() const { return area.ftX1in.cnt_in[3] == 1; }

    void grip(const Place &place)
    {
        go_above(place);
        compressor.set(true);
        vertical.move_to(place.vertical);
        valve.set(true);
        pause(500);
        vertical.move_to(0);
    }

    void release(const Place &place)
    {
        go_above(place);
        vertical.move_to(place.vertical);
        valve.set(false);
        pause(300);
        vertical.move_to(0);
        compressor.set(false);
    }

    const Colour &look()
    {
        go_above(COLOUR_SENSOR);
        vertical.move_to(COLOUR_SENSOR.vertical);
        pause(200);
        const INT16 mv = area.ftX1in.uni[7];
        vertical.move_to(0);
        return COLOURS[mv < 940 ? 0 : mv < 1430 ? 1 : 2];
    }

private:
    // High above everything that stands around.
    void go_above(const Place &place)
    {
        vertical.move_to(0);
        together([=] { rotate.move_to(place.rotate); }, [=] { horizontal.move_to(place.horizontal); });
    }

    FISH_X1_TRANSFER &area;
    Axis rotate, vertical, horizontal;
    Switch at_delivery;
    Output compressor, valve;
};

} // namespace

int main(int argc, char **argv)
{
    const int workpieces = argc > 1 ? std::atoi(argv[1]) : 3;
    return run([&] {
        // Its end may wait for the broker, so it is after that of the controller.
        Messages messages("gripper_robot");
        Controller controller;
        const auto wait = [&](const std::string &station, const std::string &state) {
            wait_for(station + ": " + state, 300, [&] { return messages.state_of(station) == state; });
        };
        Robot robot(controller.area(LOCAL_IO));
        robot.find_places();
        messages.tell("ready");
        for (int number = 0; number < workpieces; number++) {
            // The containers in column 1 are empty.
            const std::string shelf = {char('A' + number % 3), '1'};
            wait_for("a workpiece is delivered", 600, [&] { return robot.has_delivery(); });
            robot.grip(DELIVERY);
            const Colour &colour = robot.look();
            messages.tell("wants " + shelf);
            wait("high_bay_warehouse", "offers " + shelf);
            robot.release(ABOVE_CONTAINER);
            messages.tell("has taken " + shelf);
            wait("high_bay_warehouse", "has stored " + shelf);

            messages.tell("wants " + shelf);
            wait("high_bay_warehouse", "offers " + shelf);
            robot.grip(IN_CONTAINER);
            messages.tell("has taken " + shelf);
            wait("processing_station", "free");
            const std::string sorted = std::string("sorted ") + colour.name;
            const int before = messages.times_told("sorting_line", sorted);
            robot.release(OVEN);
            messages.tell(std::string("has brought ") + colour.name);
            wait_for("sorting_line: " + sorted, 300, [&] {
                return messages.times_told("sorting_line", sorted) > before;
            });
            robot.grip(colour.storage);
            wait_for("the pickup is free", 600, [&] { return robot.is_pickup_free(); });
            robot.release(PICKUP);
            messages.tell(std::string("has finished ") + colour.name);
        }
    });
}
