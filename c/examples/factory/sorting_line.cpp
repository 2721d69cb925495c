// Sorts discs by their colour: a belt carries each one past a colour sensor and three valves that blow it into its
// storage. It publishes each disc over MQTT.
#include "station.h"

unsigned int DebugFlags;
FILE *DebugFile;

using namespace factory;

namespace {

enum Colour { WHITE, RED, BLUE };
const char *const NAMES[] = {"white", "red", "blue"};
// How many edges of the pulse switch the belt runs from the second light barrier to each valve.
const int EDGES[] = {5, 15, 26};
const int DISC_BELOW_MV = 2000;
const int WHITE_BELOW_MV = 940;
const int RED_BELOW_MV = 1430;

class SortingLine {
public:
    explicit SortingLine(FISH_X1_TRANSFER &area)
        : area(area), belt(area, 1), start(area, 1), before_valves(area, 3),
          storages{{area, 6}, {area, 7}, {area, 8}}, valves{{area, 5}, {area, 6}, {area, 7}}, compressor(area, 8)
    {
        area.ftX1config.uni[1].mode = MODE_U;
        area.ftX1config.uni[1].digital = false;
        area.ftX1state.config_id++;
    }

    bool has_disc() const { return start.is_interrupted(); }

    Colour sort()
    {
        belt.right();
        const Colour colour = look();
        compressor.set(true);
        count_edges(EDGES[colour]);
        valves[colour].pulse(200);
        belt.stop();
        compressor.set(false);
        wait_for("the disc falls into its storage", 10, [&] { return storages[colour].is_interrupted(); });
        return colour;
    }

private:
    // The lowest voltage while the disc passes shows its colour.
    Colour look()
    {
        INT16 lowest = DISC_BELOW_MV;
        wait_for("a disc comes to the valves", 20, [&] {
            lowest = std::min(lowest, area.ftX1in.uni[1]);
            return before_valves.is_interrupted();
        });
        return lowest < WHITE_BELOW_MV ? WHITE : lowest < RED_BELOW_MV ? RED : BLUE;
    }

    void count_edges(int edges)
    {
        INT16 level = area.ftX1in.cnt_in[0];
        wait_for("the belt runs", 20, [&] {
            if (area.ftX1in.cnt_in[0] != level) {
                level = area.ftX1in.cnt_in[0];
                edges--;
            }
            return edges <= 0;
        });
    }

    FISH_X1_TRANSFER &area;
    Drive belt;
    Switch start, before_valves;
    Switch storages[3];
    Output valves[3], compressor;
};

} // namespace

int main(int argc, char **argv)
{
    const int discs = argc > 1 ? std::atoi(argv[1]) : 3;
    return run([&] {
        // Its end may wait for the broker, so it is after that of the controller.
        Messages messages("sorting_line");
        Controller controller;
        SortingLine line(controller.area(LOCAL_IO));
        messages.tell("ready");
        for (int disc = 0; disc < discs; disc++) {
            wait_for("a disc is put in", 600, [&] { return line.has_disc(); });
            messages.tell(std::string("sorted ") + NAMES[line.sort()]);
        }
    });
}
