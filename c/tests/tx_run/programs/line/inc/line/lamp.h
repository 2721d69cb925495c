#ifdef __cplusplus
extern "C"
#endif
int lamp_duty(int on);
