/* The part of libfreefare's interface that a robot with a reader for tags uses; reader.c explains it. */
#ifndef FACTORY_READER_FREEFARE_H
#define FACTORY_READER_FREEFARE_H

#include <nfc/nfc.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct freefare_tag *FreefareTag;

enum freefare_tag_type { MIFARE_ULTRALIGHT, MIFARE_CLASSIC_1K, NTAG_21x };

/* A list that ends with NULL. */
FreefareTag *freefare_get_tags(nfc_device *device);
void freefare_free_tags(FreefareTag *tags);
enum freefare_tag_type freefare_get_tag_type(FreefareTag tag);
const char *freefare_get_tag_friendly_name(FreefareTag tag);
/* The caller frees it. */
char *freefare_get_tag_uid(FreefareTag tag);

int ntag21x_connect(FreefareTag tag);
int ntag21x_disconnect(FreefareTag tag);
int ntag21x_get_info(FreefareTag tag);
int ntag21x_read4(FreefareTag tag, uint8_t page, uint8_t *data);
int ntag21x_fast_read(FreefareTag tag, uint8_t first_page, uint8_t last_page, uint8_t *data);
int ntag21x_write(FreefareTag tag, uint8_t page, uint8_t data[4]);

#ifdef __cplusplus
}
#endif
#endif
