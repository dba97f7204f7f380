"""The manner in which the simulated instruments answer: IEEE 488.2 messages, SCPI commands and status.

Nothing here knows a device. A device lists its commands (`tree.Command`) and says how it is
(`instrument.Device`); `instrument.Instrument` reads messages for it, keeps its status registers and
its error queue, and writes the answers.

Numbers of errors, status bits and the rules of headers are those of IEEE 488.2-1992 and SCPI 1999.0.
"""
