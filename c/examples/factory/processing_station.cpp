// Burns and saws a workpiece: an oven with a feeder, a vacuum gripper on a slide, a turntable, and a belt that carries
// it away. It begins when a workpiece lies on the feeder, and publishes each step over MQTT.
#include "station.h"

unsigned int DebugFlags;
FILE *DebugFile;

using namespace factory;

namespace {

class ProcessingStation {
public:
    ProcessingStation(FISH_X1_TRANSFER &master, FISH_X1_TRANSFER &extension)
        : table(master, 1), table_at_gripper(master, 1), table_at_saw(master, 2), table_at_belt(master, 3),
          saw_motor(master, 2), belt(master, 3), belt_end(master, 4), ejector(master, 7), compressor(master, 8),
          feeder(extension, 1), feeder_inside(extension, 1), feeder_outside(extension, 2), slide(extension, 2),
          slide_at_table(master, 5), slide_at_oven(extension, 3), on_feeder(extension, 5), vacuum(extension, 5),
          lowered(extension, 6), door(extension, 7), light(extension, 8)
    {
    }

    void find_places()
    {
        door.set(true);
        together([this] { table.left_to(table_at_gripper); }, [this] { feeder.left_to(feeder_outside); },
                 [this] { slide.left_to(slide_at_table); });
    }

    bool has_workpiece() const { return on_feeder.is_interrupted(); }

    // Meanwhile the gripper comes.
    void burn()
    {
        compressor.set(true);
        feeder.right_to(feeder_inside);
        door.set(false);
        together([this] { slide.right_to(slide_at_oven); },
                 [this] {
                     for (int i = 0; i < 14; i++)
                         light.pulse(200), pause(200);
                 });
        door.set(true);
        feeder.left_to(feeder_outside);
    }

    void carry_to_table()
    {
        lowered.set(true);
        pause(800);
        vacuum.set(true);
        pause(800);
        lowered.set(false);
        together([this] { slide.left_to(slide_at_table); }, [this] { table.left_to(table_at_gripper); });
        lowered.set(true);
        pause(400);
        vacuum.set(false);
        pause(300);
        lowered.set(false);
    }

    void saw()
    {
        table.right_to(table_at_saw);
        saw_motor.right();
        pause(2500);
        saw_motor.left();
        pause(2500);
        saw_motor.stop();
    }

    void deliver()
    {
        table.right_to(table_at_belt);
        belt.right();
        pause(400);
        ejector.pulse(100);
        wait_for("the workpiece comes to the end of the belt", 10, [this] { return belt_end.is_interrupted(); });
        wait_for("the workpiece leaves the belt", 10, [this] { return !belt_end.is_interrupted(); });
        pause(1000);
        belt.stop();
        compressor.set(false);
    }

private:
    SwitchAxis table;
    Switch table_at_gripper, table_at_saw, table_at_belt;
    Drive saw_motor, belt;
    Switch belt_end;
    Output ejector, compressor;
    SwitchAxis feeder;
    Switch feeder_inside, feeder_outside;
    SwitchAxis slide;
    Switch slide_at_table, slide_at_oven;
    Switch on_feeder;
    Output vacuum, lowered, door, light;
};

} // namespace

int main(int argc, char **argv)
{
    const int workpieces = argc > 1 ? std::atoi(argv[1]) : 1;
    return run([&] {
        // Its end may wait for the broker, so it is after that of the controller.
        Messages messages("processing_station");
        Controller controller;
        ProcessingStation station(controller.area(LOCAL_IO), controller.area(REMOTE_IO_1));
        station.find_places();
        messages.tell("ready");
        for (int workpiece = 0; workpiece < workpieces; workpiece++) {
            if (!station.has_workpiece())
                messages.tell("free");
            wait_for("a workpiece is put on the feeder", 600, [&] { return station.has_workpiece(); });
            // Who puts it there needs a moment to let go of it.
            pause(3000);
            messages.tell("burns");
            station.burn();
            station.carry_to_table();
            messages.tell("saws");
            station.saw();
            station.deliver();
            messages.tell("done");
        }
    });
}
