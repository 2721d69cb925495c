/* The part of libnfc's interface that a robot with a reader for tags uses; reader.c explains it. */
#ifndef FACTORY_READER_NFC_H
#define FACTORY_READER_NFC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nfc_context nfc_context;
typedef struct nfc_device nfc_device;
typedef char nfc_connstring[1024];

typedef enum { NMT_ISO14443A = 1 } nfc_modulation_type;
typedef enum { NBR_106 = 1 } nfc_baud_rate;

typedef struct {
    nfc_modulation_type nmt;
    nfc_baud_rate nbr;
} nfc_modulation;

typedef struct {
    char uid[15];
} nfc_target;

const char *nfc_version(void);
void nfc_init(nfc_context **context);
void nfc_exit(nfc_context *context);
size_t nfc_list_devices(nfc_context *context, nfc_connstring found[], size_t most);
nfc_device *nfc_open(nfc_context *context, const nfc_connstring name);
void nfc_close(nfc_device *device);
int nfc_initiator_init(nfc_device *device);
int nfc_initiator_list_passive_targets(nfc_device *device, nfc_modulation modulation, nfc_target found[], size_t most);
const char *nfc_device_get_name(nfc_device *device);
void nfc_perror(const nfc_device *device, const char *text);
int str_nfc_target(char **text, const nfc_target *target, bool verbose);
void nfc_free(void *memory);

#ifdef __cplusplus
}
#endif
#endif
