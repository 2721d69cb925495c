// Turns M1 for 100 pulses of its counter, as programs with ftMscLib and P/Invoke did for the ROBO TX.
//
// Plug an encoder motor into M1 and C1, and a button into I1. Put ftMscLib.dll (libftMscLib.so,
// libftMscLib.dylib) beside the program, or where the system looks for libraries. Then
//
//     dotnet run -- COM1
//
// with COM1 for USB, COM2 for Wi-Fi, COM3 for Bluetooth, or with a host: 192.168.7.2, 127.0.0.1:65000.

using System;
using System.Runtime.InteropServices;
using System.Text;
using System.Threading;

internal static class FtMscLib
{
    private const string Library = "ftMscLib";

    /// <summary>Is called in the library's thread. On 32-bit Windows it is __stdcall.</summary>
    [UnmanagedFunctionPointer(CallingConvention.StdCall)]
    public delegate void EventCallback(uint controller, uint index);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint ftxInitLib();

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint ftxCloseLib();

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl, CharSet = CharSet.Ansi)]
    public static extern IntPtr ftxOpenComDevice(string port, uint baud, out uint error);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint ftxCloseDevice(IntPtr device);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint ftxStartTransferArea(IntPtr device);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint ftxStopTransferArea(IntPtr device);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl, CharSet = CharSet.Ansi)]
    public static extern uint ftxGetLibErrorString(uint error, uint kind, StringBuilder text, uint size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl, CharSet = CharSet.Ansi)]
    public static extern uint GetRoboTxFwStr(IntPtr device, int controller, StringBuilder text, uint size);

    // A bool of C++ has one byte; without this it would be a BOOL of four.
    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint SetFtUniConfig(
        IntPtr device, int controller, int input, int mode, [MarshalAs(UnmanagedType.I1)] bool digital);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint StartMotorExCmd(
        IntPtr device, int controller, int motor, int duty, int direction, int slave, int slaveDirection,
        int pulses);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint GetInIOValue(
        IntPtr device, int controller, int input, out short value, out int overrun);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint GetInCounterValue(
        IntPtr device, int controller, int counter, out short count, out short level);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void SetCBMotorExReached(EventCallback callback);
}

internal static class MotorDistance
{
    private const int Master = 0, M1 = 0, I1 = 0, C1 = 0, ModeR = 1, Clockwise = 0, NoSlave = -1;

    private static readonly ManualResetEvent Arrived = new ManualResetEvent(false);

    // A field, so that the garbage collector leaves it while the library may call it.
    private static readonly FtMscLib.EventCallback OnArrived = (controller, motor) =>
    {
        Console.WriteLine("M" + (motor + 1) + " has arrived");
        Arrived.Set();
    };

    private static void Check(uint code)
    {
        if (code == 0)
        {
            return;
        }
        var text = new StringBuilder(100);
        FtMscLib.ftxGetLibErrorString(code, 1, text, (uint)text.Capacity);
        throw new InvalidOperationException(text + " (0x" + code.ToString("X8") + ")");
    }

    private static string Drive(IntPtr device)
    {
        Check(FtMscLib.SetFtUniConfig(device, Master, I1, ModeR, true));
        FtMscLib.SetCBMotorExReached(OnArrived);
        Check(FtMscLib.StartMotorExCmd(device, Master, M1, 512, Clockwise, NoSlave, 0, 100));
        Arrived.WaitOne(TimeSpan.FromSeconds(30));
        Check(FtMscLib.GetInIOValue(device, Master, I1, out short value, out int overrun));
        Check(FtMscLib.GetInCounterValue(device, Master, C1, out short count, out short level));
        FtMscLib.SetCBMotorExReached(null);
        return "C1 has counted " + count + " pulses, I1 is " + value;
    }

    private static int Main(string[] arguments)
    {
        string port = arguments.Length > 0 ? arguments[0] : "COM1";
        string driven = null, failure = null;
        try
        {
            Check(FtMscLib.ftxInitLib());
            IntPtr device = FtMscLib.ftxOpenComDevice(port, 38400, out uint error);
            Check(error);
            var firmware = new StringBuilder(20);
            FtMscLib.GetRoboTxFwStr(device, Master, firmware, (uint)firmware.Capacity);
            Console.WriteLine(port + ": firmware " + firmware);
            Check(FtMscLib.ftxStartTransferArea(device));
            driven = Drive(device);
        }
        catch (InvalidOperationException exception)
        {
            // It is said when the motors are off: nobody may read it.
            failure = exception.Message;
        }
        finally
        {
            // Closes the device, too, with all motors off.
            FtMscLib.ftxCloseLib();
        }
        if (failure != null)
        {
            Console.Error.WriteLine(failure);
            return 1;
        }
        Console.WriteLine(driven);
        Console.WriteLine("all motors off");
        return 0;
    }
}
