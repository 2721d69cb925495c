/*
 * A simulated reader for NFC tags, for a robot's program that expects libnfc and a libfreefare with NTAG 21x, which
 * Debian 12 does not have. Compiled together with the program:
 *
 *   tx_run PROGRAM ... c/examples/factory/reader -I c/examples/factory/reader
 *
 * The variable FACTORY_TAG says what lies on the reader whenever the program looks:
 *
 *   white, red, blue   a tag of a workpiece of this colour; white if the variable is not set
 *   none               no tag
 *
 * What the program writes to a tag it can read again, until it ends.
 */
#include <string.h>

#include "freefare.h"

#define PAGES 45 /* of an NTAG 213, with four bytes each */
#define HEADER 4 /* the first page that a program may write */

struct nfc_context {
    int unused;
};

struct nfc_device {
    int unused;
};

struct freefare_tag {
    const char *colour, *uid;
    uint8_t pages[PAGES][4];
};

static struct nfc_context context;
static struct nfc_device device;

/* The second byte of page HEADER is the colour, as the factory counts: 1 white, 2 red, 3 blue. */
static struct freefare_tag tags[] = {
    {"white", "04000000000001", {{0}, {0}, {0}, {0}, {0, 1}}},
    {"red", "04000000000002", {{0}, {0}, {0}, {0}, {0, 2}}},
    {"blue", "04000000000003", {{0}, {0}, {0}, {0}, {0, 3}}},
};

/* The tag on the reader, or NULL. */
static FreefareTag tag_here(void)
{
    const char *wanted = getenv("FACTORY_TAG");
    size_t i;

    for (i = 0; i < sizeof tags / sizeof tags[0]; i++)
        if (strcmp(wanted ? wanted : "white", tags[i].colour) == 0)
            return &tags[i];
    return NULL;
}

static char *copy_of(const char *text)
{
    char *copy = (char *) malloc(strlen(text) + 1);

    return copy ? strcpy(copy, text) : NULL;
}

const char *nfc_version(void) { return "simulated"; }
void nfc_init(nfc_context **made) { *made = &context; }
void nfc_exit(nfc_context *old) { (void) old; }

size_t nfc_list_devices(nfc_context *of, nfc_connstring found[], size_t most)
{
    (void) of;
    if (most == 0)
        return 0;
    strcpy(found[0], "simulated");
    return 1;
}

nfc_device *nfc_open(nfc_context *of, const nfc_connstring name)
{
    (void) of;
    (void) name;
    return &device;
}

void nfc_close(nfc_device *old) { (void) old; }

int nfc_initiator_init(nfc_device *reader)
{
    (void) reader;
    return 0;
}

int nfc_initiator_list_passive_targets(nfc_device *reader, nfc_modulation modulation, nfc_target found[], size_t most)
{
    FreefareTag tag = tag_here();

    (void) reader;
    (void) modulation;
    if (!tag || most == 0)
        return 0;
    strcpy(found[0].uid, tag->uid);
    return 1;
}

const char *nfc_device_get_name(nfc_device *reader)
{
    (void) reader;
    return "simulated reader";
}

void nfc_perror(const nfc_device *reader, const char *text)
{
    (void) reader;
    fprintf(stderr, "%s: the simulated reader has no errors\n", text);
}

int str_nfc_target(char **text, const nfc_target *target, bool verbose)
{
    (void) verbose;
    *text = copy_of(target->uid);
    return *text ? (int) strlen(*text) : -1;
}

void nfc_free(void *memory) { free(memory); }

FreefareTag *freefare_get_tags(nfc_device *reader)
{
    FreefareTag *list = (FreefareTag *) calloc(2, sizeof *list);

    (void) reader;
    if (list)
        list[0] = tag_here();
    return list;
}

void freefare_free_tags(FreefareTag *list) { free(list); }

enum freefare_tag_type freefare_get_tag_type(FreefareTag tag)
{
    (void) tag;
    return NTAG_21x;
}

const char *freefare_get_tag_friendly_name(FreefareTag tag)
{
    (void) tag;
    return "NTAG 213 (simulated)";
}

char *freefare_get_tag_uid(FreefareTag tag) { return copy_of(tag->uid); }

int ntag21x_connect(FreefareTag tag)
{
    (void) tag;
    return 0;
}

int ntag21x_disconnect(FreefareTag tag)
{
    (void) tag;
    return 0;
}

int ntag21x_get_info(FreefareTag tag)
{
    (void) tag;
    return 0;
}

int ntag21x_read4(FreefareTag tag, uint8_t page, uint8_t *data)
{
    return ntag21x_fast_read(tag, page, page, data);
}

int ntag21x_fast_read(FreefareTag tag, uint8_t first, uint8_t last, uint8_t *data)
{
    if (first > last || last >= PAGES)
        return -1;
    memcpy(data, tag->pages[first], 4 * (size_t) (last - first + 1));
    return 0;
}

int ntag21x_write(FreefareTag tag, uint8_t page, uint8_t data[4])
{
    if (page < HEADER || page >= PAGES)
        return -1;
    memcpy(tag->pages[page], data, 4);
    return 0;
}
