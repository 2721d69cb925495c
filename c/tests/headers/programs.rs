//! What programs do with the headers.

use super::compilers::{self, Language};

/// A downloaded program: it defines once more what the header has, brings its own dispatcher, uses hooks
/// and callbacks.
const DOWNLOADED: &str = r#"
#include "ROBO_TX_PRG.h"
#define TRUE 1
#define FALSE 0
static TA *area;
static bool wait = false;
static char text[DISPL_MSG_LEN_MAX + 1];
static int PrgDisp(TA *p_ta_array, int ta_count);
extern const struct prg_code_intro_s prg_code_intro;
const struct prg_code_intro_s prg_code_intro = {PRG_MAGIC, {TA_VERSION}, (unsigned long) PrgDisp};
static void on_value(struct ta_s *p_ta, I2C_CB *p_data)
{
    if (p_data->status == I2C_SUCCESS && p_data->value > 5)
        p_ta->output.duty[0] = DUTY_MAX;
}
void PrgInit(TA *p_ta_array, int ta_count)
{
    area = &p_ta_array[TA_LOCAL];
    area->config.motor[0] = TRUE;
    area->config.uni[7].mode = MODE_R;
    area->config.uni[7].digital = TRUE;
    area->state.config_id++;
    wait = ta_count != TA_COUNT ? true : false;
}
int PrgTic(TA *p_ta_array, int ta_count)
{
    UINT32 now = area->hook_table.GetSystemTime(TIMER_UNIT_SECONDS);
    if (!area->hook_table.IsRunAllowed() || wait)
        return MIN(ta_count, 0);
    area->hook_table.sprintf(text, "%s %d", "tic", (int) MAX(now, 3));
    area->hook_table.memcpy(text, "tic", area->hook_table.strlen("tic"));
    area->hook_table.DisplayMsg(area, NULL);
    area->hook_table.I2cRead(0x40, 0, 5, on_value);
    p_ta_array[TA_EXT_1].input.cnt_resetted[N_CNT - 1] = FALSE;
    return area->info.version.firmware.part.c ? 0x7FFF : 0;
}
static int PrgDisp(TA *p_ta_array, int ta_count)
{
    PrgInit(p_ta_array, ta_count);
    return PrgTic(p_ta_array, ta_count);
}
"#;

/// A PC program with the names of Windows.
const ON_THE_PC: &str = r#"
#include <stdio.h>
#include <windows.h>
#include <conio.h>
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"
#include "ftErrCode.h"
static void __stdcall on_reached(DWORD controller, DWORD motor)
{
    printf("%u %u\n", (unsigned) controller, (unsigned) motor);
}
int main(void)
{
    DWORD error = FTLIB_ERR_SUCCESS;
    BYTE states[8];
    char port[] = "COM4", name[DEV_NAME_LEN_MAX + 1];
    INT16 value;
    BOOL32 overrun;
    HANDLE device;
    volatile TA_ARRAY *areas;
    if (ftxInitLib() != FTLIB_ERR_SUCCESS)
        return 1;
    device = ftxOpenComDevice(port, 38400, &error);
    if (device == NULL || error)
        return 1;
    SetCBMotorExReached(on_reached);
    SetCBMotorExReached(NULL);
    areas = GetTransferAreasArrayAddr(device);
    areas->ftxTransferArea[TA_LOCAL].output.duty[0] = DUTY_MAX;
    SetFtUniConfig(device, TA_LOCAL, 0, MODE_R, TRUE);
    GetInIOValue(device, TA_LOCAL, 0, &value, &overrun);
    GetRoboTxDevName(device, TA_LOCAL, name, sizeof(name));
    GetRoboTxSlaveState(device, states);
    while (!_kbhit() && !overrun)
        Sleep(10);
    return _getch() == 27 ? 0 : (int) ftxCloseLib();
}
"#;

#[cfg_attr(windows, ignore = "a long holds no address there, as the program takes it")]
#[test]
fn a_downloaded_program_compiles_unchanged() {
    for compiler in compilers::all() {
        compiler.check_all(DOWNLOADED);
    }
}

#[test]
fn a_pc_program_compiles_unchanged() {
    for compiler in compilers::all() {
        compiler.check_all(ON_THE_PC);
    }
}

/// What calls `PrgInit` and `PrgTic` is in C, whatever the program is in.
#[cfg_attr(windows, ignore = "a long holds no address there, as the program takes it")]
#[test]
fn a_program_in_cpp_has_functions_for_c() {
    for compiler in compilers::all().iter().filter(|one| one.language == Language::Cpp) {
        let Some(c) = compilers::for_c().next() else { continue };
        let program = compilers::write(DOWNLOADED, Language::Cpp);
        let caller = compilers::write(
            "void PrgInit(void *, int);\nint PrgTic(void *, int);\nint main(int count, char **all) {\n\
             if (count > 9) { PrgInit(all, 9); return PrgTic(all, 9); }\nreturn 0;\n}\n",
            Language::C,
        );
        let object = caller.with_extension("o");
        let compiled = c.command().arg("-c").arg(&caller).arg("-o").arg(&object).output().unwrap();
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let linked = compiler
            .command()
            .args(compilers::includes())
            .arg(&program)
            .arg(&object)
            .arg("-o")
            .arg(caller.with_extension("exe"))
            .output()
            .unwrap();
        assert!(linked.status.success(), "{}", String::from_utf8_lossy(&linked.stderr));
    }
}
