"""MPEG-4 XMT-A, the XML form of BIFS scenes (ISO/IEC 14496-11)."""
