// Reads and writes what lies on the simulated reader for tags, as a robot's program does.
#include <cstdio>
#include <cstdlib>

#include <freefare.h>
#include <nfc/nfc.h>

static bool is_done(int result)
{
    return result >= 0;
}

int main()
{
    nfc_context *context = nullptr;
    nfc_connstring found[4];
    nfc_init(&context);
    if (nfc_list_devices(context, found, 4) != 1)
        return 1;
    nfc_device *device = nfc_open(context, found[0]);
    nfc_modulation modulation = {NMT_ISO14443A, NBR_106};
    nfc_target targets[4];
    if (!device || nfc_initiator_init(device) < 0)
        return 2;
    const int count = nfc_initiator_list_passive_targets(device, modulation, targets, 4);

    FreefareTag *tags = freefare_get_tags(device);
    FreefareTag tag = tags[0];
    if ((tag != nullptr) != (count == 1))
        return 3;
    if (tag) {
        uint8_t header[4], written[4] = {9, 8, 7, 6}, pages[36 * 4];
        char *uid = freefare_get_tag_uid(tag);
        if (freefare_get_tag_type(tag) != NTAG_21x || !is_done(ntag21x_connect(tag)) || !is_done(ntag21x_get_info(tag)))
            return 4;
        if (!is_done(ntag21x_read4(tag, 4, header)) || !is_done(ntag21x_write(tag, 5, written)))
            return 5;
        // The pages of the number, and those that there are not.
        if (is_done(ntag21x_write(tag, 0, written)) || is_done(ntag21x_fast_read(tag, 40, 45, pages)))
            return 6;
        if (!is_done(ntag21x_fast_read(tag, 4, 39, pages)) || tags[1])
            return 7;
        std::printf("%s type %d, then %d %d %d %d\n", uid, header[1], pages[4], pages[5], pages[6], pages[7]);
        std::free(uid);
        ntag21x_disconnect(tag);
    } else {
        std::puts("no tag");
    }
    freefare_free_tags(tags);
    nfc_close(device);
    nfc_exit(context);
    return 0;
}
