"""A process outside closes the loop of a run: messages, the server's socket, a client, the blocks.

`cdpr serve SCENARIO` simulates; in the place of one block of the loop it asks a client. The two
exchange messages over ZeroMQ: the server binds a ROUTER socket, tcp://127.0.0.1:5757 unless asked
otherwise, and clients connect REQ or DEALER sockets; every request has one reply. Nothing is
encrypted and nobody is asked for a password: whoever reaches the port may drive the run. Clients
speak ZMTP 3, as ZeroMQ 4 and newer do; older ones are refused, and so is plain text of a web page.

A message is one frame with one object, as JSON in UTF-8 or as msgpack, and the reply comes as the
request did; the first byte tells which. Numbers are binary64 and pass unchanged: msgpack has them
as they are, JSON as the shortest decimal that reads back the same. In JSON null stands for a number
that is none. Vectors are lists, poses are (qw, qx, qy, qz, x, y, z), spatial vectors (rotation,
translation), all in SI units and radians. At most 1 MiB a message.

=============================================== ================================================
request                                         reply
=============================================== ================================================
{"do": "describe"}                              {"ok": true, "protocol": 1, "scenario", "robot",
                                                "cables": names, "place", "pace", "rate",
                                                "duration", "inputs": {name: {"size", "unit",
                                                "meaning"}}, "outputs": the same}
{"do": "start", "outputs": [names]}             the first instant; without "outputs", all
{"do": "step", "inputs": {name: [numbers]}}     the next instant, or the end
{"do": "distribute", "pose": [7]}               {"ok": true, "feasible", "status", "tensions"}:
                                                tensions that hold the platform at rest; with
                                                "wrench": [6], that put F_P_W about Po on it. Also
                                                "limits": [2] and "method": name
{"do": "stop"}                                  the end
=============================================== ================================================

An instant is {"ok": true, "time": t, "outputs": {name: [numbers]}}: what the run's ports show at
time t [s]. The end is {"ok": true, "end": {"outcome", "message", "sim_time_s"}}. What is not
accepted is answered with {"ok": false, "error": words}. In msgpack a vector may also be bytes:
binary64 numbers one after the other, the least significant byte first. Who starts with
"packed": true is shown its outputs so.

Who says start drives the run, alone; describe and distribute are answered to all, at any time that
the server listens: before the run, while it waits for the driver, and at the end of each period.
What anybody sends who does not drive the run is answered in words if it makes no sense, and the
server waits on.
Place, pace and time-out are the scenario's section `remote`:

* lock_step: the run stands still from an instant to the step that answers it. Same commands, same
  log, byte for byte, as from the block inside.
* real_time: one simulated second takes one; a command holds until the next one comes, and is taken
  at the next instant. The clock starts with the first step.

A driver that goes away, is silent for longer than the time-out, says stop, or sends what makes no
sense (a message that cannot be read, unknown or missing ports, wrong sizes, numbers that are not
finite) ends the run with outcome client_ended; what was simulated is written.

The blocks in whose place the process outside stands are each the block that they replace, with the
same ports, so that logs and figures stay. Where that would decide, they ask a `Remote`, which knows
a `Driver` while a run is driven. They offer it as `outside`, which is all that a run knows of it.
`RemoteTensionLoop` does the same without a diagram, in compiled steps from instant to instant.

Source: the interfaces of the Gazebo thesis, 3.5 and chapter 6: poses, set points and tensions as
topics, tension distribution as a service.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
