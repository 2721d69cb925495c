/* A camera at /dev/video0, see camera.c. */
int camera_open(void);
int camera_is(int fd);
void camera_closed(int fd);
int camera_ioctl(unsigned long request, void *argument);
