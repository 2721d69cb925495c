/* Stands in for two libraries that Debian does not have: libjpeg 8, only with its names, and the one of the touch
   screen, which is empty. */
#define NOTHING(name) void *name(void) { return 0; }

NOTHING(jpeg_CreateDecompress)
NOTHING(jpeg_destroy_decompress)
NOTHING(jpeg_mem_src)
NOTHING(jpeg_read_header)
NOTHING(jpeg_read_raw_data)
NOTHING(jpeg_start_decompress)
NOTHING(jpeg_std_error)
