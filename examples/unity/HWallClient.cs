// A client of `bridge` in C#, for Unity or any .NET: sends hands and gaze, tells where the board is and where the virtual hand must stop.
// Messages: docs/PROTOCOL.md. Unity: put this file into Assets, add HWallBoard to the object that stands for the board, set its address.
// Elsewhere: mcs HWallClient.cs && mono HWallClient.exe ws://127.0.0.1:8080/ws
// From another machine the address ends with the key that the bridge prints: ws://HOST:8080/ws?key=KEY, wss://HOST:8443/ws?key=KEY with --tls.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Net.WebSockets;
using System.Text;
using System.Threading;
using System.Threading.Tasks;

namespace HWall
{
    /// <summary>What the server said last. Base frame of the arm: z up, right-handed, metres; quaternions x, y, z, w.</summary>
    public sealed class View
    {
        public double Time;
        public string State = "";
        public double[] BoardPosition = { 0, 0, 0 };
        public double[] BoardOrientation = { 0, 0, 0, 1 };
        /// <summary>Where the board is sent: point and unit normal; null: nowhere.</summary>
        public double[] GoalPoint, GoalNormal;
        /// <summary>Where the hand will touch: point on the surface and its unit normal, towards the person; null: not known.</summary>
        public double[] PredictedPoint, PredictedNormal;
        /// <summary>True while nothing can be behind the surface that the hand approaches.</summary>
        public bool Unreachable;

        /// <summary>A point of the virtual hand, moved back to the surface if it is behind it and nothing real can be there.</summary>
        public double[] Stopped(double[] point)
        {
            if (!Unreachable || PredictedPoint == null) return point;
            double behind = 0;
            for (int i = 0; i < 3; i++) behind += (PredictedPoint[i] - point[i]) * PredictedNormal[i];
            if (!(behind > 0)) return point;
            return new[] { point[0] + behind * PredictedNormal[0], point[1] + behind * PredictedNormal[1], point[2] + behind * PredictedNormal[2] };
        }
    }

    public sealed class Client : IDisposable
    {
        readonly ClientWebSocket socket = new ClientWebSocket();
        readonly CancellationTokenSource end = new CancellationTokenSource();
        readonly DateTime began = DateTime.UtcNow;
        readonly object gate = new object();
        View view = new View();
        readonly SemaphoreSlim sends = new SemaphoreSlim(1, 1);
        Task reader;
        ulong sequence;

        /// <summary>What became of the connection; null while it stands.</summary>
        public volatile string Ended;

        /// <summary>Has the server prepared its walls, so that hands count?</summary>
        public volatile bool Ready;

        /// <summary>The newest view.</summary>
        public View Newest { get { lock (gate) return view; } }

        public async Task Connect(string address)
        {
            await socket.ConnectAsync(new Uri(address + (address.Contains("?") ? "&" : "?") + "format=json"), end.Token);
            reader = Task.Run(new Func<Task>(Read));
        }

        /// <summary>Sends a hand: 26 joints of OpenXR (0 the palm, 10 the tip of the index finger), null where one is not seen.</summary>
        /// <param name="head">Position and quaternion, 7 numbers, or null.</param>
        /// <param name="gaze">Direction, 3 numbers, or null.</param>
        public Task SendHand(double[][] joints, double[] head, double[] gaze, string side = "right")
        {
            var parts = new List<string>();
            foreach (var joint in joints) parts.Add(Numbers(joint));
            double ms = (DateTime.UtcNow - began).TotalMilliseconds;
            string text = "{\"type\":\"hand\",\"seq\":" + (++sequence) + ",\"client_ms\":" + ms.ToString("R", CultureInfo.InvariantCulture)
                + ",\"side\":\"" + side + "\",\"joints\":[" + string.Join(",", parts) + "],\"head\":" + Numbers(head)
                + ",\"gaze\":" + Numbers(gaze) + ",\"axes\":\"base\"}";
            return Send(text, false);
        }

        /// <summary>Stops the arm until somebody lets it go.</summary>
        public Task Stop() { return Send("{\"type\":\"stop\"}", true); }

        async Task Send(string text, bool waits)
        {
            var bytes = new ArraySegment<byte>(Encoding.UTF8.GetBytes(text));
            // A socket sends one message at a time; a second one would throw. A hand is left out then, a stop waits.
            if (!await sends.WaitAsync(waits ? Timeout.Infinite : 0, end.Token)) return;
            try { await socket.SendAsync(bytes, WebSocketMessageType.Text, true, end.Token); }
            finally { sends.Release(); }
        }

        static string Numbers(double[] values)
        {
            if (values == null) return "null";
            return "[" + string.Join(",", Array.ConvertAll(values, v => v.ToString("R", CultureInfo.InvariantCulture))) + "]";
        }

        async Task Read()
        {
            var buffer = new byte[65536];
            try
            {
                while (!end.IsCancellationRequested)
                {
                    var message = new MemoryStream();
                    WebSocketReceiveResult part;
                    do
                    {
                        part = await socket.ReceiveAsync(new ArraySegment<byte>(buffer), end.Token);
                        message.Write(buffer, 0, part.Count);
                    } while (!part.EndOfMessage);
                    if (part.MessageType == WebSocketMessageType.Close) { Ended = part.CloseStatusDescription ?? "closed"; return; }
                    Take(new Json(Encoding.UTF8.GetString(message.ToArray())).Value() as Dictionary<string, object>);
                }
            }
            catch (Exception error) { Ended = error.Message; }
        }

        void Take(Dictionary<string, object> message)
        {
            lock (gate)
            {
                string type = message["type"] as string;
                Ready |= type == "scene";
                string kind = type == "event" ? message["kind"] as string : "";
                bool unreachable = kind == "unreachable" || (kind != "goal" && view.Unreachable);
                if (type == "view")
                {
                    var board = (Dictionary<string, object>)message["board"];
                    var goal = message["goal"] as Dictionary<string, object>;
                    var predicted = message["predicted"] as Dictionary<string, object>;
                    view = new View
                    {
                        Time = (double)message["t"],
                        State = (string)message["state"],
                        BoardPosition = Vector(board["position"]),
                        BoardOrientation = Vector(board["orientation"]),
                        GoalPoint = goal == null ? null : Vector(goal["point"]),
                        GoalNormal = goal == null ? null : Vector(goal["normal"]),
                        PredictedPoint = predicted == null ? null : Vector(predicted["point"]),
                        PredictedNormal = predicted == null ? null : Vector(predicted["normal"]),
                        Unreachable = unreachable,
                    };
                }
                else view.Unreachable = unreachable;
            }
        }

        static double[] Vector(object list)
        {
            return ((List<object>)list).ConvertAll(v => v == null ? double.NaN : (double)v).ToArray();
        }

        public void Dispose()
        {
            end.Cancel();
            if (reader != null) reader.Wait(1000);
            socket.Dispose();
        }

        static int Main(string[] args)
        {
            using (var client = new Client())
            {
                try { client.Connect(args.Length > 0 ? args[0] : "ws://127.0.0.1:8080/ws").Wait(); }
                catch (AggregateException error) { Console.Error.WriteLine(error.GetBaseException().Message); return 2; }
                while (!client.Ready && client.Ended == null) Thread.Sleep(20);
                var joints = new double[26][];
                for (int n = 0; n < 8 * 72 && client.Ended == null; n++)
                {
                    // 2 s of rest 0.4 m before the front wall, 1 s to reach it, then 15 mm into it.
                    double share = Math.Min(Math.Max(n / 72.0 - 2.0, 0.0), 1.0);
                    double x = 0.62 + 0.2 * (1 + Math.Cos(Math.PI * share)) - 0.015 * share;
                    joints[0] = new[] { x + 0.17, 0.0, 0.55 };
                    joints[10] = new[] { x, 0.0, 0.55 };
                    client.SendHand(joints, new[] { 1.37, -0.2, 0.95, 0, 0, 0, 1 }, new[] { -0.75, 0.2, -0.4 }).Wait();
                    if (n % 36 == 0)
                    {
                        View view = client.Newest;
                        Console.WriteLine("{0:F2} s  {1}: board at {2:F3}, {3:F3}, {4:F3} m", view.Time, view.State,
                            view.BoardPosition[0], view.BoardPosition[1], view.BoardPosition[2]);
                    }
                    Thread.Sleep(1000 / 72);
                }
                if (client.Ended != null) Console.Error.WriteLine(client.Ended);
                return client.Newest.State == "touched" ? 0 : 1;
            }
        }
    }

    /// <summary>JSON as dictionaries, lists, strings, doubles, booleans and null.</summary>
    sealed class Json
    {
        readonly string text;
        int at;

        public Json(string text) { this.text = text; }

        char Next { get { while (char.IsWhiteSpace(text[at])) at++; return text[at]; } }

        bool Ends(char end)
        {
            if (Next == ',') at++;
            if (Next != end) return false;
            at++;
            return true;
        }

        public object Value()
        {
            switch (Next)
            {
                case '{':
                    at++;
                    var members = new Dictionary<string, object>();
                    while (!Ends('}')) { string name = Text(); if (Next == ':') at++; members[name] = Value(); }
                    return members;
                case '[':
                    at++;
                    var items = new List<object>();
                    while (!Ends(']')) items.Add(Value());
                    return items;
                case '"': return Text();
                case 't': at += 4; return true;
                case 'f': at += 5; return false;
                case 'n': at += 4; return null;
                default:
                    int from = at;
                    while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0) at++;
                    return double.Parse(text.Substring(from, at - from), CultureInfo.InvariantCulture);
            }
        }

        string Text()
        {
            var read = new StringBuilder();
            for (at += Next == '"' ? 1 : 0; text[at] != '"'; at++)
            {
                if (text[at] != '\\') { read.Append(text[at]); continue; }
                at++;
                if (text[at] == 'u') { read.Append((char)Convert.ToInt32(text.Substring(at + 1, 4), 16)); at += 4; }
                else read.Append("\"\\/\b\f\n\r\t"["\"\\/bfnrt".IndexOf(text[at])]);
            }
            at++;
            return read.ToString();
        }
    }
}

#if UNITY_5_3_OR_NEWER
namespace HWall
{
    using UnityEngine;

    /// <summary>Moves its object as the real board moves. Set the pose of the arm's base in the scene by the parent of this object.</summary>
    public sealed class HWallBoard : MonoBehaviour
    {
        public string Address = "ws://127.0.0.1:8080/ws";
        public Client Client { get; private set; }

        async void Start()
        {
            Client = new Client();
            try { await Client.Connect(Address); }
            catch (System.Exception error) { Debug.LogError("H-Wall: " + error.Message); }
        }

        void Update()
        {
            View view = Client.Newest;
            transform.localPosition = ToUnity(view.BoardPosition);
            transform.localRotation = ToUnity(view.BoardOrientation, 0);
        }

        void OnDestroy() { Client.Dispose(); }

        /// <summary>Unity is left-handed with y up: x stays, y and z change places.</summary>
        public static Vector3 ToUnity(double[] v) { return new Vector3((float)v[0], (float)v[2], (float)v[1]); }

        public static Quaternion ToUnity(double[] q, int from)
        {
            return new Quaternion(-(float)q[from], -(float)q[from + 2], -(float)q[from + 1], (float)q[from + 3]);
        }

        /// <summary>A position of Unity in the arm's base frame.</summary>
        public static double[] FromUnity(Vector3 v) { return new double[] { v.x, v.z, v.y }; }
    }
}
#endif
