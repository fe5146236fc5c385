"""Short almanacs: two satellites in SEM, one in YUMA."""

from datetime import date

JANUARY_2007 = date(2007, 1, 22)

SEM = """2 CURRENT.ALM
 387 589824

1
32
0
 6.7005157470703E-03  1.4945983886719E-02 -2.4774635676295E-09
 5.1536845703125E+03 -5.7885289192200E-01 -5.5991351604462E-01
-5.1991939544678E-01  1.0395050048828E-04  3.6379788070917E-12
0
9

4
34
15
 7.8029632568359E-03  1.3942718505859E-03 -2.5102053768933E-09
 5.1536923828125E+03  7.4491012096405E-01  7.8417301177979E-02
 6.8036389350891E-01  3.5762786865234E-04  3.6379788070917E-12
63
9
"""

YUMA = """******** Week  377 almanac for PRN-01 ********
ID:                         01
Health:                     000
Eccentricity:               0.6597995758E-002
Time of Applicability(s):  319488.0000
Orbital Inclination(rad):   0.9893061549
Rate of Right Ascen(r/s):  -0.7508884204E-008
SQRT(A)  (m 1/2):           5153.683594
Right Ascen at Week(rad):  -0.5644326501E+000
Argument of Perigee(rad):  -1.781409342
Mean Anom(rad):             0.4668447322E+000
Af0(s):                     0.8964538574E-004
Af1(s/s):                   0.3637978807E-011
week:                        377
"""
