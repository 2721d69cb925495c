// Fetches containers from their shelves, brings them out on the belt, and stores them again. The arguments are shelves,
// such as A1 or C3. Without any it does what the gripper robot asks for over MQTT: "wants B2", and later "has taken
// B2". With a number, such as 6, it ends after so many of these orders; the robot has two for each workpiece.
#include <cctype>
#include <climits>

#include "station.h"

unsigned int DebugFlags;
FILE *DebugFile;

using namespace factory;

namespace {

// Places in pulses from the reference switches; a larger row is lower.
const int COLUMNS[] = {780, 1390, 1995};
const int ROWS[] = {80, 445, 855};
const int BELT_COLUMN = 20, BELT_ROW = 720;
// So much the cantilever is lifted to take a container.
const int LIFT = 40;

struct Shelf {
    explicit Shelf(const std::string &name)
    {
        const int row_index = name.size() == 2 ? std::toupper(name[0]) - 'A' : -1;
        const int column_index = name.size() == 2 ? name[1] - '1' : -1;
        if (row_index < 0 || row_index > 2 || column_index < 0 || column_index > 2)
            throw std::runtime_error("there is no shelf " + name + "; there are A1 to C3");
        column = COLUMNS[column_index];
        row = ROWS[row_index];
    }
    int column, row;
};

class Warehouse {
public:
    explicit Warehouse(FISH_X1_TRANSFER &area)
        : belt(area, 1), outside(area, 1), inside(area, 4), horizontal(area, 2, 5), vertical(area, 4, 8),
          cantilever(area, 3), back(area, 6), front(area, 7)
    {
    }

    void find_places()
    {
        cantilever.left_to(back);
        together([this] { horizontal.find_reference(); }, [this] { vertical.find_reference(); });
    }

    void fetch(const Shelf &shelf)
    {
        move(shelf.column, shelf.row);
        cantilever.right_to(front);
        vertical.move_to(shelf.row - LIFT);
        cantilever.left_to(back);
    }

    void store(const Shelf &shelf)
    {
        move(shelf.column, shelf.row - LIFT);
        cantilever.right_to(front);
        vertical.move_to(shelf.row + LIFT);
        cantilever.left_to(back);
    }

    void bring_out()
    {
        move(BELT_COLUMN, BELT_ROW - LIFT);
        cantilever.right_to(front);
        vertical.move_to(BELT_ROW + LIFT);
        belt.right();
        wait_for("the container comes out", 10, [this] { return outside.is_interrupted(); });
        belt.stop();
        cantilever.left_to(back);
    }

    void take_in()
    {
        move(BELT_COLUMN, BELT_ROW);
        cantilever.right_to(front);
        belt.left();
        wait_for("the container comes in", 10, [this] { return inside.is_interrupted(); });
        pause(200);
        belt.stop();
        vertical.move_to(BELT_ROW - LIFT);
        cantilever.left_to(back);
    }

private:
    void move(int column, int row)
    {
        together([=] { horizontal.move_to(column); }, [=] { vertical.move_to(row); });
    }

    Drive belt;
    Switch outside, inside;
    Axis horizontal, vertical;
    SwitchAxis cantilever;
    Switch back, front;
};

// The shelf in "wants B2", or nothing.
std::string shelf_in(const std::string &state, const std::string &words)
{
    return state.compare(0, words.size(), words) == 0 ? state.substr(words.size()) : "";
}

} // namespace

int main(int argc, char **argv)
{
    return run([&] {
        const bool ordered = argc < 2 || std::isdigit(argv[1][0]);
        const int count = argc < 2 ? INT_MAX : ordered ? std::atoi(argv[1]) : argc - 1;
        // Its end may wait for the broker, so it is after that of the controller.
        Messages messages("high_bay_warehouse");
        Controller controller;
        Warehouse warehouse(controller.area(LOCAL_IO));
        warehouse.find_places();
        messages.tell("ready");
        for (int number = 0; number < count; number++) {
            std::string name = ordered ? "" : argv[number + 1];
            if (ordered)
                wait_for("an order", 3600, [&] {
                    name = shelf_in(messages.state_of("gripper_robot"), "wants ");
                    return !name.empty();
                });
            const Shelf shelf(name);
            warehouse.fetch(shelf);
            warehouse.bring_out();
            messages.tell("offers " + name);
            if (ordered)
                wait_for("the robot takes the workpiece", 600, [&] {
                    return shelf_in(messages.state_of("gripper_robot"), "has taken ") == name;
                });
            warehouse.take_in();
            warehouse.store(shelf);
            messages.tell("has stored " + name);
        }
    });
}
